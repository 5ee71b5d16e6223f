"""Claims about the second experiment: learned parameters, best episode, the separation line, the cost."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.stats import percentileofscore

from pipelines import measures
from pipelines.experiments import Found, Settings
from pipelines.paper import companions, convergence, figure_5, figure_6, gyres, information, rules
from pipelines.paper.claim import Claim, counted
from pipelines.paper.rules import Finding
from pipelines.paper.table_2 import PAPER
from pipelines.report import spread

PAPER_BEST = 7


def claims(settings: Settings, runs: Mapping[str, Found]) -> list[Claim]:
    """All of them, in the order of the paper."""
    run, random = runs[gyres.RUN], companions.double_gyre(runs).others["random"]
    return [
        *(learned(run, random, number) for number in range(run.record.sizes["parameter"])),
        best_episode(run),
        spreading(settings, run),
        separation(run),
        cost(run),
    ]


def learned(run: Found, random: Found, number: int) -> Claim:
    """One of the parameters of table 2."""
    record = run.record
    name, true = str(record["parameter"].values[number]), float(record["true"].values[number])
    claimed = abs(PAPER[name] - true)
    ours, others = (_errors_of_best(each, number) for each in (run, random))
    pooled = spread(np.abs(record["pooled"].values[:, number] - true), 2)
    return Claim(
        name=f"Learned {name}",
        where="table 2",
        text=f"{name} = {true:.4g} is learned as {PAPER[name]:.4f}, an error of {claimed:.4f}",
        hypotheses={"": [rules.reached(f"error of {name}, best episode", ours, claimed, others)]},
        why=(
            f"The samples of all episodes together give {name} with an error of {pooled}; the best episode "
            "alone is chosen by its e_total, not by its error. It takes no trained vehicle."
        ),
        replicates=counted(run),
    )


def best_episode(run: Found) -> Claim:
    """Which episode has the least error."""
    best = run.record["best_episode"].values.astype(int) + 1
    share = percentileofscore(best, PAPER_BEST, kind="mean")
    measured = f"{spread(best, 2)}; the paper's is at percentile {share:.0f} of ours"
    return Claim(
        name="Best episode",
        where="section 5",
        text=f"the smallest estimation error is that of episode {PAPER_BEST} of 10",
        hypotheses={"": [rules.unsaid("best episodes of the replicates", measured)]},
        why="e_total at the end of an episode is mostly its noise, so any episode can have the least.",
        replicates=counted(run),
    )


def spreading(settings: Settings, run: Found) -> Claim:
    """The feature spreads."""
    found = figure_5.spread(figure_5.true_fields(settings, run))
    first, *_, last = found["radius"]
    lost = abs(found["mass"][-1] / found["mass"][0] - 1)
    grows = bool(last >= (1 + rules.NEAR) * first)
    return Claim(
        name="Spread of the feature",
        where="figure 5",
        text="the double gyre spreads the feature through time",
        hypotheses={"": [rules.fact("rms radius [length]", f"{first:.1f} → {last:.1f}", grows)]},
        why=(
            "It is drawn along the walls and across the separation line; its total changes by "
            f"{100 * lost:.2g} % in the figure's sampling of the field."
        ),
        replicates="one solve, no chance in it",
    )


def separation(run: Found) -> Claim:
    """At the separation line the vehicle can lose the feature."""
    beyond = figure_6.crosses(run)
    field = information.field_along(run)
    values = field[..., field.shape[-1] // 2 :].mean(axis=-1)
    errors = measures.error_of_theta(run.record)
    return Claim(
        name="Separation line",
        where="figures 6A, B",
        text="at the line between the gyres the vehicle can take a wrong action and lose the feature",
        hypotheses={
            "": [
                _parted("field along the second half", values, beyond, -1),
                _parted("|estimate - true|", errors, beyond, 1),
            ]
        },
        why=(
            "A part of the feature crosses the line too (figure 5), so a vehicle beyond it need not have "
            "left the feature."
        ),
        replicates=f"{np.sum(_both(beyond))} replicates that have episodes of both kinds",
    )


def cost(run: Found) -> Claim:
    """What the optimisation takes."""
    solves = run.record["forward_solves"].sum("episode").values
    measured = f"{spread(solves)} for {convergence.folds(run.record)} fits and folds"
    return Claim(
        name="Cost",
        where="section 5",
        text="the optimisation needs the solution of the PDE many times, and a server of 20 cores",
        hypotheses={"": [rules.unsaid("solves of a replicate", measured)]},
        why="The paper gives neither a time nor a number of solves; here two cores are enough.",
        replicates=counted(run),
    )


def _errors_of_best(run: Found, number: int) -> NDArray[np.float64]:
    """|error| of a parameter in the best episode of every replicate, (replicates,)."""
    final = run.record["theta"].isel(step=-1).transpose("replicate", "episode", "parameter").values
    return np.abs(measures.of_best(run.record, final) - run.record["true"].values)[:, number]


def _both(beyond: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Replicates that have episodes of both kinds, (replicates,)."""
    return np.asarray(beyond.any(axis=1) & ~beyond.all(axis=1))


def _parted(label: str, values: NDArray, beyond: NDArray[np.bool_], sign: int) -> Finding:
    """Mean over the episodes that stay against mean over those that cross, replicate by replicate."""
    kept, crossing = values[_both(beyond)], beyond[_both(beyond)]
    staying, gone = (
        np.where(which, kept, 0.0).sum(axis=1) / which.sum(axis=1) for which in (~crossing, crossing)
    )
    return rules.change(f"{label}, staying → crossing episodes", staying, gone, sign)
