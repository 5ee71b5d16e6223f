"""Claims about the first experiment: total error, the estimate of b, and what figure 3 varies.

Whether the paper's fits were local or global cannot be told from its text: each is a hypothesis.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipelines import measures
from pipelines.experiments import Found, Settings
from pipelines.paper import companions, rules, variations
from pipelines.paper.claim import Claim, counted
from pipelines.paper.rules import Finding
from pipelines.paper.variations import ESTIMATORS

PAPER_B = (4.928, 5.037)
PAPER_ERROR = 0.0809

_Value = Callable[[xr.Dataset], NDArray[np.float64]]
_Test = Callable[[str], list[Finding]]


def claims(settings: Settings, runs: Mapping[str, Found]) -> list[Claim]:
    """All of them, in the order of the paper."""
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
    )
    return [claim(settings, runs) for claim in made]


def usual(runs: Mapping[str, Found], estimator: str) -> Found:
    """The run with the paper's settings."""
    return runs[variations.name(estimator, "step_size", 0.9)]


def late_mean(record: xr.Dataset, name: str) -> NDArray[np.float64]:
    """Mean of a variable over the late episodes of each replicate, (replicates,)."""
    return measures.late(measures.final(record, name)).mean(axis=1)


def total_error(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """e_total is close to 2 at the end."""

    def test(estimator: str) -> list[Finding]:
        record = usual(runs, estimator).record
        errors = measures.late(measures.final(record, "e_total"))
        expected = 2 * float(record.attrs["noise"]) ** 2
        return [
            rules.value("mean e_total of late episodes", errors.mean(axis=1), expected),
            rules.value("median e_total of late episodes", np.median(errors, axis=1), expected),
        ]

    return _claim(
        runs,
        "Total error at the end",
        "section 5, abstract",
        "e_total is close to 2 at the end of the learning process",
        test,
        "Fits that reach their global minimum leave the noise, 2 sigma^2, from the first episode on; with "
        "one start some fits miss it and weigh on the mean.",
    )


def noise_share(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """e_f and e_cv each approximate sigma^2."""

    def test(estimator: str) -> list[Finding]:
        record = usual(runs, estimator).record
        variance = float(record.attrs["noise"]) ** 2
        return [rules.value(name, late_mean(record, name), variance) for name in ("e_f", "e_cv")]

    sizes = usual(runs, "global").record.sizes
    n, p = sizes["step"], sizes["parameter"]
    return _claim(
        runs,
        "Its two parts",
        "Eq. 27",
        "e_f and e_cv each approximate the variance of the noise, 1",
        test,
        f"{p} parameters fitted to {n} samples take about {p}/{n} of the variance from e_f and add as much "
        "to e_cv, so that only their sum is 2 sigma^2. These shares lie on the rule's 10 %.",
    )


def flow(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """The error of b."""
    random = {each.name: each.others["random"] for each in companions.advection(runs)}

    def test(estimator: str) -> list[Finding]:
        ours, others = (
            measures.of_best(run.record, measures.error_of_theta(run.record))
            for run in (usual(runs, estimator), random[ESTIMATORS[estimator].short])
        )
        return [rules.reached("error of b, best episode", ours, PAPER_ERROR, others)]

    return _claim(
        runs,
        "Estimate of the flow",
        "section 5",
        f"b_hat = {PAPER_B} for b = (5, 5), an error of {PAPER_ERROR}",
        test,
        "The best episode is the one of least e_total, which hardly depends on how well b is known, so its "
        "error scatters widely, and one run's is no measure of a method.",
    )


def field(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """True and estimated feature are similar."""

    def test(estimator: str) -> list[Finding]:
        record = usual(runs, estimator).record
        noise = float(record.attrs["noise"]) / float(record["field_true"].max())
        errors = measures.field_error(record)
        return [rules.small("rms difference / peak", errors, noise, "the noise of a sample / peak")]

    return _claim(
        runs,
        "Estimated feature",
        "figure 4D",
        "the true and the estimated feature are similar at the final time",
        test,
        "An error of b moves the feature by that error times the time, little against its width. The paper "
        "does not say how similar; we ask for less than the noise of one sample.",
    )


def step_size(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """Smaller step sizes."""
    values = variations.values("step_size", settings)
    small, large = values[0], values[-1]

    def test(estimator: str) -> list[Finding]:
        low, high = (runs[variations.name(estimator, "step_size", value)].record for value in (small, large))
        found = []
        for name, sign in (("return", 1), ("e_total", -1)):
            curve = measures.final(low, name)
            first, last = measures.early(curve).mean(axis=1), measures.late(curve).mean(axis=1)
            found.append(rules.change(f"{name}, early → late episodes at {small:g}", first, last, sign))
            found.append(
                rules.change(
                    f"{name}, {large:g} → {small:g}", late_mean(high, name), late_mean(low, name), sign
                )
            )
        return found

    return _claim(
        runs,
        "Step size",
        "figures 3A, B",
        "smaller step sizes increase the return through the episodes and slightly decrease the error",
        test,
        "With global fits the reward hardly depends on the path, so there is little to learn at any step "
        "size; with one start the return depends on rare failed fits.",
    )


def trace_decay(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """Larger trace decay."""
    values = variations.values("trace_decay", settings)

    def test(estimator: str) -> list[Finding]:
        return [
            _between(
                runs, estimator, "trace_decay", values, f"{name}, ", lambda r, n=name: late_mean(r, n), sign
            )
            for name, sign in (("e_total", -1), ("return", 1))
        ]

    return _claim(
        runs,
        "Trace decay",
        "figures 3C, D",
        "larger lambda significantly decreases the error and increases the return",
        test,
        "The effect needs fits that can fail: with one start the vehicle learns to avoid paths on which they "
        "do, and long traces carry the late reward back; with global fits nothing depends on lambda.",
    )


def exploration(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """Similar results for different epsilon."""
    values = variations.values("exploration", settings)

    def test(estimator: str) -> list[Finding]:
        low, high = (
            runs[variations.name(estimator, "exploration", value)].record for value in (values[0], values[-1])
        )
        return [
            rules.same(
                f"{name}, epsilon {values[0]:g} → {values[-1]:g}", late_mean(low, name), late_mean(high, name)
            )
            for name in ("e_total", "return")
        ]

    return _claim(
        runs,
        "Exploration",
        "figures 3E, F",
        "different values of epsilon give similar results",
        test,
        "With one start more random actions mean more paths on which fits fail; with global fits no path is "
        "much worse than another.",
    )


def exploring(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """Higher epsilon explores more."""
    values, text = variations.values("exploration", settings), "scatter of the paths' ends [length], epsilon "

    def test(estimator: str) -> list[Finding]:
        return [_between(runs, estimator, "exploration", values, text, measures.spread_of_ends, 1)]

    return _claim(
        runs,
        "Exploratory behaviour",
        "section 5",
        "higher epsilon makes the vehicle explore more",
        test,
        "Late paths scatter for another reason too: the policy goes on changing while it learns.",
    )


def greedy(settings: Settings, runs: Mapping[str, Found]) -> Claim:
    """Share of greedy actions."""
    mission = usual(runs, "global").mission
    epsilon: float = mission.agent.exploration  # type: ignore[attr-defined]
    share = 1 - epsilon + epsilon / len(mission.vehicle.actions)
    holds = f"{share:.2g}" == f"{0.75:.2g}"
    return Claim(
        name="Greedy actions",
        where="section 5",
        text="epsilon = 0.15 takes the greedy action 75 % of the time",
        hypotheses={"": [rules.fact("share of greedy actions", f"{share:.3f}", holds)]},
        why="The share is 1 - epsilon + epsilon / 7, for the random choice may be the greedy one.",
        replicates="by definition",
    )


def _claim(runs: Mapping[str, Found], name: str, where: str, text: str, test: _Test, why: str) -> Claim:
    """A claim with a hypothesis for each way of fitting."""
    hypotheses = {each.short: test(estimator) for estimator, each in ESTIMATORS.items()}
    return Claim(name, where, text, hypotheses, why, counted(usual(runs, "global")))


def _between(
    runs: Mapping[str, Found],
    estimator: str,
    parameter: str,
    values: tuple[float, ...],
    label: str,
    measure: _Value,
    sign: int,
) -> Finding:
    """A change from the least to the greatest value of a parameter that is varied."""
    low, high = (
        measure(runs[variations.name(estimator, parameter, value)].record)
        for value in (values[0], values[-1])
    )
    return rules.change(f"{label}{values[0]:g} → {values[-1]:g}", low, high, sign)
