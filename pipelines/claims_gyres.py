"""Claims about the second experiment: learned parameters, best episode, following, the separation line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipelines import convergence, figure_5, figure_6, gyres, measures, rules
from pipelines.claims_advection import counted
from pipelines.experiments import Found, Settings
from pipelines.report import spread
from pipelines.rules import Finding
from pipelines.table_2 import PAPER

PAPER_BEST = 7
_VISIBLE = 3.0  # a sample is in the feature when its value exceeds so many standard deviations of the noise


def claims(settings: Settings, runs: Mapping[str, Found]) -> list[dict[str, Any]]:
    """The arguments of every claim."""
    run = runs[gyres.RUN]
    return [
        *(learned(run, number) for number in range(run.record.sizes["parameter"])),
        best_episode(run),
        spreading(settings, run),
        following(run),
        separation(run),
        cost(run),
    ]


def learned(run: Found, number: int) -> dict[str, Any]:
    """One of the parameters of table 2."""
    record = run.record
    name, true = str(record["parameter"].values[number]), float(record["true"].values[number])
    final = record["theta"].isel(step=-1).transpose("replicate", "episode", "parameter").values
    values = measures.of_best(record, final)[:, number]
    claimed = abs(PAPER[name] - true)
    measured = f"{spread(values, 4)}, error {spread(np.abs(values - true), 2)}"
    outcome = rules.accuracy(np.abs(values - true), claimed)
    pooled = spread(np.abs(record["pooled"].values[:, number] - true), 2)
    return {
        "name": f"Learned {name}",
        "where": "table 2",
        "text": f"{name} = {true:.4g} is learned as {PAPER[name]:.4f}, an error of {claimed:.4f}",
        "findings": [Finding(f"{name}, best episode", measured, outcome, "accuracy")],
        "why": (
            f"The samples of all episodes together give {name} with an error of {pooled}; the best episode "
            "alone is chosen by its e_total, not by its error."
        ),
        "replicates": counted(run),
    }


def best_episode(run: Found) -> dict[str, Any]:
    """Which episode has the least error."""
    best = run.record["best_episode"].values.astype(int) + 1
    outcome = rules.chance(best, run.record.sizes["episode"], PAPER_BEST)
    measured = ", ".join(str(number) for number in best)
    return {
        "name": "Best episode",
        "where": "section 5",
        "text": f"the smallest estimation error is that of episode {PAPER_BEST} of 10",
        "findings": [Finding("best episodes of the replicates", measured, outcome, "chance")],
        "why": "e_total at the end of an episode is mostly its noise, so any episode can have the least.",
        "replicates": counted(run),
    }


def spreading(settings: Settings, run: Found) -> dict[str, Any]:
    """The feature spreads."""
    found = figure_5.spread(figure_5.true_fields(settings, run))
    radius = found["radius"]
    outcome = rules.Outcome.YES if radius[-1] >= (1 + rules.NEAR) * radius[0] else rules.Outcome.NO
    lost = abs(found["mass"][-1] / found["mass"][0] - 1)
    return {
        "name": "Spread of the feature",
        "where": "figure 5",
        "text": "the double gyre spreads the feature through time",
        "findings": [
            Finding("rms radius [length]", f"{radius[0]:.1f} → {radius[-1]:.1f}", outcome, "growth")
        ],
        "why": (
            "It is drawn along the walls and across the separation line; its total changes by "
            f"{100 * lost:.2g} % in the figure's sampling of the field."
        ),
        "replicates": "one solve, no chance in it",
    }


def following(run: Found) -> dict[str, Any]:
    """The vehicle follows the feature."""
    visible = run.record["value"] > _VISIBLE * run.record.attrs["noise"]
    shares = visible.mean(("episode", "step")).values
    return {
        "name": "Following",
        "where": "figure 6",
        "text": "the vehicle follows the feature",
        "findings": [
            Finding("samples above three sigma of the noise", spread(shares), rules.share(shares), "share")
        ],
        "why": "It starts within the feature, and the same water carries both.",
        "replicates": counted(run),
    }


def separation(run: Found) -> dict[str, Any]:
    """At the separation line the vehicle can lose the feature."""
    beyond, record = figure_6.crosses(run), run.record
    half = record["value"].isel(step=slice(record.sizes["step"] // 2, None))
    values = half.mean("step").transpose("replicate", "episode").values
    errors = measures.error_of_theta(record)
    found = []
    for label, quantity, sign in (
        ("mean value of the second half", values, 1),
        ("|estimate - true|", errors, -1),
    ):
        crossing, staying = quantity[beyond], quantity[~beyond]
        pair = (crossing, staying) if sign > 0 else (staying, crossing)
        measured = (
            f"{_spread(crossing)} in {crossing.size} crossing, {_spread(staying)} in {staying.size} others"
        )
        found.append(Finding(label, measured, rules.episodes(*pair), "episodes"))
    return {
        "name": "Separation line",
        "where": "figures 6A, B",
        "text": "at the line between the gyres the vehicle can take a wrong action and lose the feature",
        "findings": found,
        "why": (
            "A part of the feature crosses the line too (figure 5), so a vehicle beyond it need not have "
            "left the feature."
        ),
        "replicates": f"{beyond.size} episodes of {beyond.shape[0]} replicates",
    }


def cost(run: Found) -> dict[str, Any]:
    """What the optimisation takes."""
    solves = run.record["forward_solves"].sum("episode").values
    measured = f"{spread(solves)} for {convergence.folds(run.record)} fits and folds"
    return {
        "name": "Cost",
        "where": "section 5",
        "text": "the optimisation needs the solution of the PDE many times, and a server of 20 cores",
        "findings": [Finding("solves of a replicate", measured, rules.Outcome.UNCLEAR, "unsaid")],
        "why": "The paper gives neither a time nor a number of solves; here two cores are enough.",
        "replicates": counted(run),
    }


def _spread(values: np.ndarray) -> str:
    return spread(values) if values.size else "none"
