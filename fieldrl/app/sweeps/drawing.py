"""Which pictures a sweep leaves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldrl import __version__
from fieldrl.app.sweeps.objective import Objective
from fieldrl.app.sweeps.results import Row

if TYPE_CHECKING:
    from fieldrl.app.sweeps.proposals import Trial
    from fieldrl.app.sweeps.search import Settings
    from fieldrl.app.sweeps.space import Space

_SEED = "seed"


def draw_grid(rows: Sequence[Row], varied: Sequence[str], objective: Objective, folder: Path) -> None:
    """The results over one or two keys; nothing where more of them vary.

    Results at the same values of these keys, seeds and replicates, are the spread of a point. The seed is a
    key of its own only where nothing else varies.

    Args:
        rows: of all jobs.
        varied: keys that the sweep varies.
        objective: what is drawn.
        folder: where to, it exists.
    """
    from fieldrl.figures import files, sweeps

    keys = [key for key in varied if key != _SEED] or list(varied)
    at = [list(dict.fromkeys(row.varied[key] for row in rows)) for key in keys]
    if not 1 <= len(keys) <= 2 or not any(row.values for row in rows):
        return
    if len(keys) == 1:
        results = [found(rows, {keys[0]: value}) for value in at[0]]
        drawing = sweeps.line_figure(keys[0], at[0], results, objective.path)
    else:
        cells = [[found(rows, {keys[0]: y, keys[1]: x}) for x in at[1]] for y in at[0]]
        drawing = sweeps.heat_map_figure((keys[0], keys[1]), (at[0], at[1]), cells, objective.path)
    files.save_noted(drawing, folder / "results.png", provenance("results.png", rows))


def draw_search(
    rows: Sequence[Row], folder: Path, trials: Sequence[Trial], space: Space, settings: Settings
) -> None:
    """The course of a search and how its objective depends on each key; nothing where every job failed.

    Args:
        rows: of all jobs.
        folder: where to, it exists.
        trials: points and losses, in the order of the rows.
        space: what was searched.
        settings: of the search.
    """
    from fieldrl.app.sweeps.proposals import dependence
    from fieldrl.figures import files, search

    values = [row.value for row in rows]
    if all(value is None for value in values):
        return
    path, sign = settings.objective.path, settings.objective.loss(1.0)
    drawing = search.convergence_figure(values, sign, path, settings.n_initial)
    files.save_noted(drawing, folder / "convergence.png", provenance("convergence.png", rows))
    curves = dependence(space, trials, settings.seed) if len(trials) > 1 else [([], [])] * len(space.keys)
    panels = [
        search.Panel(
            key, [point[i] for point, _ in trials], places, [sign * loss for loss in mean],
            dimension.log, dimension.choices,
        )
        for i, (key, dimension, (places, mean)) in enumerate(
            zip(space.keys, space.dimensions, curves, strict=True)
        )
    ]  # fmt: skip
    drawing = search.dependence_figure(panels, values, path)
    files.save_noted(drawing, folder / "dependence.png", provenance("dependence.png", rows))


def found(rows: Sequence[Row], at: dict[str, str]) -> list[float]:
    """The objective's numbers of every job with these values."""
    return [
        value
        for row in rows
        if all(row.varied[key] == text for key, text in at.items())
        for value in row.values
    ]


def provenance(name: str, rows: Sequence[Row]) -> dict[str, Any]:
    """Which picture this is, and of which runs."""
    finished = [row for row in rows if row.summary]
    experiments = list(dict.fromkeys(row.summary["experiment"] for row in finished))
    keys = [row.key for row in finished]
    return {"file": name, "experiment": ", ".join(experiments), "keys": keys, "version": __version__}
