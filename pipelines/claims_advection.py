"""Claims about the first experiment: learning curves, error of b, the shape of good paths."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipelines import measures, rules, variations
from pipelines.experiments import Found, Settings
from pipelines.report import spread
from pipelines.rules import Finding

PAPER_B = (4.928, 5.037)
PAPER_ERROR = 0.0809
_ESTIMATORS = {"single_start": "one start", "global": "global fits"}
_Value = Callable[[xr.Dataset], NDArray[np.float64]]


def claims(settings: Settings, runs: Mapping[str, Found]) -> list[dict[str, Any]]:
    """The arguments of every claim."""
    made = (
        total_error,
        noise_share,
        flow,
        field,
        step_size,
        trace_decay,
        exploration,
        exploring,
        greedy,
        paths,
    )
    return [claim(settings, runs) for claim in made]


def usual(runs: Mapping[str, Found], estimator: str) -> Found:
    """The run with the paper's settings."""
    return runs[variations.name(estimator, "step_size", 0.9)]


def counted(run: Found) -> str:
    """How many replicates and episodes."""
    sizes = run.record.sizes
    return f"{sizes['replicate']} replicates of {sizes['episode']} episodes"


def total_error(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """e_total is close to 2 at the end."""
    found = []
    for estimator, text in _ESTIMATORS.items():
        record = usual(runs, estimator).record
        expected = 2 * float(record.attrs["noise"]) ** 2
        errors = measures.late(measures.final(record, "e_total"))
        for kind, values in (("mean", errors.mean(axis=1)), ("median", np.median(errors, axis=1))):
            label = f"{kind} e_total of late episodes, {text}"
            found.append(Finding(label, spread(values), rules.value(values, expected), "value"))
    return {
        "name": "Total error at the end",
        "where": "section 5, abstract",
        "text": "e_total is close to 2 at the end of the learning process",
        "findings": found,
        "why": (
            "Fits that reach their global minimum leave the noise, 2 sigma^2, from the first episode on; "
            "with one start some fits miss it and weigh on the mean."
        ),
        "replicates": counted(usual(runs, "global")),
    }


def noise_share(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """e_f and e_cv each approximate sigma^2."""
    record = usual(runs, "global").record
    found = []
    for name in ("e_f", "e_cv"):
        values = measures.late(measures.final(record, name)).mean(axis=1)
        outcome = rules.value(values, float(record.attrs["noise"]) ** 2)
        found.append(Finding(f"{name}, global fits", spread(values), outcome, "value"))
    n, p = record.sizes["step"], record.sizes["parameter"]
    return {
        "name": "Its two parts",
        "where": "Eq. 27",
        "text": "e_f and e_cv each approximate the variance of the noise, 1",
        "findings": found,
        "why": (
            f"{p} parameters fitted to {n} samples take about {p}/{n} of the variance from e_f and add as "
            "much to e_cv, so that only their sum is 2 sigma^2."
        ),
        "replicates": counted(usual(runs, "global")),
    }


def flow(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """The error of b."""
    found = []
    for estimator, text in _ESTIMATORS.items():
        record = usual(runs, estimator).record
        errors = measures.of_best(record, measures.error_of_theta(record))
        final = record["theta"].isel(step=-1).transpose("replicate", "episode", "parameter").values
        middle = np.median(measures.of_best(record, final), axis=0)
        measured = f"{spread(errors, 2)}, median b_hat ({middle[0]:.3f}, {middle[1]:.3f})"
        outcome = rules.accuracy(errors, PAPER_ERROR)
        found.append(Finding(f"error of b, best episode, {text}", measured, outcome, "accuracy"))
    return {
        "name": "Estimate of the flow",
        "where": "section 5",
        "text": f"b_hat = {PAPER_B} for b = (5, 5), an error of {PAPER_ERROR}",
        "findings": found,
        "why": (
            "The best episode is the one of least e_total, which hardly depends on how well b is known, so "
            "its error scatters widely over replicates."
        ),
        "replicates": counted(usual(runs, "global")),
    }


def field(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """True and estimated feature are similar."""
    found = []
    for estimator, text in _ESTIMATORS.items():
        errors = measures.field_error(usual(runs, estimator).record)
        found.append(
            Finding(
                f"rms difference / peak, {text}",
                spread(errors, 2),
                rules.accuracy(errors, rules.SIMILAR),
                "field",
            )
        )
    return {
        "name": "Estimated feature",
        "where": "figure 4D",
        "text": "the true and the estimated feature are similar at the final time",
        "findings": found,
        "why": "An error of b moves the feature by that error times the time, little against its width.",
        "replicates": counted(usual(runs, "global")),
    }


def step_size(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """Smaller step sizes."""
    values = variations.values("step_size", settings)
    small, large = values[0], values[-1]
    found = []
    for estimator, text in _ESTIMATORS.items():
        low, high = (runs[variations.name(estimator, "step_size", value)].record for value in (small, large))
        for name, sign, quantity in (("return", 1, "return"), ("e_total", -1, "e_total")):
            curve = measures.final(low, name)
            first, last = measures.early(curve).mean(axis=1), measures.late(curve).mean(axis=1)
            label = f"{quantity} through the episodes, {text}"
            found.append(_trend(label, first, last, sign))
            at_large = measures.late(measures.final(high, name)).mean(axis=1)
            label = f"{quantity} at {small:g} against {large:g}, {text}"
            found.append(_trend(label, at_large, last, sign))
    return {
        "name": "Step size",
        "where": "figures 3A, B",
        "text": "smaller step sizes increase the return through the episodes and slightly decrease the error",
        "findings": found,
        "why": (
            "With global fits the reward hardly depends on the path, so there is little to learn at any "
            "step size; with one start the return depends on rare failed fits and scatters more than the "
            "step size matters."
        ),
        "replicates": counted(usual(runs, "global")),
    }


def trace_decay(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """Larger trace decay."""
    values = variations.values("trace_decay", settings)
    found = []
    for estimator, text in _ESTIMATORS.items():
        low, high = (
            runs[variations.name(estimator, "trace_decay", v)].record for v in (values[0], values[-1])
        )
        for name, sign in (("e_total", -1), ("return", 1)):
            first, last = (measures.late(measures.final(record, name)).mean(axis=1) for record in (low, high))
            label = f"{name} at {values[0]:g} → {values[-1]:g}, {text}"
            found.append(_trend(label, first, last, sign))
    return {
        "name": "Trace decay",
        "where": "figures 3C, D",
        "text": "larger lambda significantly decreases the error and increases the return",
        "findings": found,
        "why": (
            "The effect needs fits that can fail: with one start the vehicle learns to avoid paths on which "
            "they do, and long traces carry the late reward back; with global fits nothing depends on "
            "lambda."
        ),
        "replicates": counted(usual(runs, "global")),
    }


def exploration(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """Similar results for different epsilon."""
    found = []
    for name in ("e_total", "return"):
        for estimator, text in _ESTIMATORS.items():
            first, last = _extremes(
                settings, runs, estimator, lambda record, name=name: _late_mean(record, name)
            )
            measured = f"{spread(first)} → {spread(last)}"
            found.append(Finding(f"{name}, {text}", measured, rules.sameness(first, last), "sameness"))
    return {
        "name": "Exploration",
        "where": "figures 3E, F",
        "text": "different values of epsilon give similar results",
        "findings": found,
        "why": (
            "With one start more random actions mean more paths on which fits fail; with global fits no "
            "path is much worse than another."
        ),
        "replicates": counted(usual(runs, "global")),
    }


def exploring(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """Higher epsilon explores more."""
    found = []
    for estimator, text in _ESTIMATORS.items():
        first, last = _extremes(settings, runs, estimator, measures.spread_of_ends)
        found.append(_trend(f"scatter of the paths' ends [length], {text}", first, last, 1))
    return {
        "name": "Exploratory behaviour",
        "where": "section 5",
        "text": "higher epsilon makes the vehicle explore more",
        "findings": found,
        "why": "Late paths scatter for another reason too: the policy goes on changing while it learns.",
        "replicates": counted(usual(runs, "global")),
    }


def greedy(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """Share of greedy actions."""
    mission = usual(runs, "global").mission
    epsilon: float = mission.agent.exploration  # type: ignore[attr-defined]
    share = 1 - epsilon + epsilon / len(mission.vehicle.actions)
    outcome = rules.definition(share, 0.75)
    return {
        "name": "Greedy actions",
        "where": "section 5",
        "text": "epsilon = 0.15 takes the greedy action 75 % of the time",
        "findings": [Finding("share of greedy actions", f"{share:.3f}", outcome, "definition")],
        "why": "The share is 1 - epsilon + epsilon / 7, for the random choice may be the greedy one.",
        "replicates": "by definition",
    }


def paths(settings: Settings, runs: Mapping[str, Found]) -> dict[str, Any]:
    """Good paths follow the feature and cross its level sets."""
    found = []
    for estimator, text in _ESTIMATORS.items():
        run = usual(runs, estimator)
        amplitude: float = run.mission.water.initial.amplitude  # type: ignore[attr-defined]
        for label, values in (
            ("mean sampled value", measures.followed(run.record)),
            ("level sets crossed", measures.crossed(run.record, amplitude)),
        ):
            worst, best = measures.by_accuracy(run.record, values)
            found.append(_trend(f"{label}, least against most accurate tenth, {text}", worst, best, 1))
    return {
        "name": "Good paths",
        "where": "figures 4A-C",
        "text": "optimal paths follow the feature and cross its level sets",
        "findings": found,
        "why": "A sample tells of b where the feature is steep; level sets are a tenth of its height apart.",
        "replicates": counted(usual(runs, "global")),
    }


def _extremes(
    settings: Settings, runs: Mapping[str, Found], estimator: str, measure: _Value
) -> tuple[NDArray, NDArray]:
    """A measure at the least and at the greatest epsilon, (replicates,) each."""
    values = variations.values("exploration", settings)
    low, high = (
        runs[variations.name(estimator, "exploration", value)].record for value in (values[0], values[-1])
    )
    return measure(low), measure(high)


def _late_mean(record: xr.Dataset, name: str) -> NDArray[np.float64]:
    return measures.late(measures.final(record, name)).mean(axis=1)


def _trend(label: str, first: NDArray, last: NDArray, sign: int) -> Finding:
    """A change between paired values, judged by the rule for trends."""
    right = int(np.sum((last - first) * sign > 0))
    measured = f"{spread(first)} → {spread(last)}, as claimed in {right} of {first.size}"
    return Finding(label, measured, rules.trend(first, last, sign), "trend")
