"""Which pictures a sweep leaves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldrl import __version__
from fieldrl.sweeps.objective import Objective
from fieldrl.sweeps.sweep_job import SweepJob

if TYPE_CHECKING:
    from fieldrl.sweeps.proposals import Trial
    from fieldrl.sweeps.space import Space

_SEED = "seed"


def draw_grid(jobs: Sequence[SweepJob], folder: Path, varied: Sequence[str], objective: Objective) -> None:
    """The results over one or two keys; nothing where more of them vary.

    Results at the same values of these keys, seeds and replicates, are the spread of a point. The seed is a
    key of its own only where nothing else varies.

    Args:
        jobs: all of them.
        folder: where to, it exists.
        varied: keys that the sweep varies.
        objective: what is drawn.
    """
    from fieldrl.figures import files, sweeps

    keys = [key for key in varied if key != _SEED] or list(varied)
    at = [list(dict.fromkeys(job.varied[key] for job in jobs)) for key in keys]
    if not 1 <= len(keys) <= 2 or not any(job.values for job in jobs):
        return
    if len(keys) == 1:
        results = [_values(jobs, {keys[0]: value}) for value in at[0]]
        drawing = sweeps.line_figure(keys[0], at[0], results, objective.path)
    else:
        cells = [[_values(jobs, {keys[0]: y, keys[1]: x}) for x in at[1]] for y in at[0]]
        drawing = sweeps.heat_map_figure((keys[0], keys[1]), (at[0], at[1]), cells, objective.path)
    files.save_noted(drawing, folder / "results.png", _provenance("results.png", jobs))


def draw_search(
    jobs: Sequence[SweepJob],
    folder: Path,
    trials: Sequence[Trial],
    space: Space,
    objective: Objective,
    initial: int,
    seed: int,
) -> None:
    """The course of a search and how its objective depends on each key; nothing where every job failed.

    Args:
        jobs: all of them.
        folder: where to, it exists.
        trials: points and losses, in the order of the jobs.
        space: what was searched.
        objective: what was searched for.
        initial: size of the initial design.
        seed: of the search.
    """
    from fieldrl.figures import files, search
    from fieldrl.sweeps.proposals import dependence

    values = [job.value for job in jobs]
    if all(value is None for value in values):
        return
    path, sign = objective.path, objective.loss(1.0)
    drawing = search.convergence_figure(values, sign, path, initial)
    files.save_noted(drawing, folder / "convergence.png", _provenance("convergence.png", jobs))
    curves = dependence(space, trials, seed) if len(trials) > 1 else [([], [])] * len(space.keys)
    panels = [
        search.Panel(
            key, [point[i] for point, _ in trials], along, [sign * loss for loss in mean],
            dimension.log, dimension.choices,
        )
        for i, (key, dimension, (along, mean)) in enumerate(
            zip(space.keys, space.dimensions, curves, strict=True)
        )
    ]  # fmt: skip
    drawing = search.dependence_figure(panels, values, path)
    files.save_noted(drawing, folder / "dependence.png", _provenance("dependence.png", jobs))


def _values(jobs: Sequence[SweepJob], at: dict[str, str]) -> list[float]:
    """The objective's numbers of every job with these values."""
    found = (job for job in jobs if all(job.varied[key] == text for key, text in at.items()))
    return [value for job in found for value in job.values]


def _provenance(name: str, jobs: Sequence[SweepJob]) -> dict[str, Any]:
    """Which picture this is, and of which runs."""
    finished = [job for job in jobs if job.summary]
    experiments = list(dict.fromkeys(job.summary["experiment"] for job in finished))
    keys = [job.key for job in finished]
    return {"file": name, "experiment": ", ".join(experiments), "keys": keys, "version": __version__}
