"""Figure 4: paths over the feature's level sets for the variations of figure 3, and the estimated feature.

python -m pipelines.paper.figure_4 [scale=small]

A-C are drawn for both estimators of figure 3; D is the best episode of replicate 0, global fits.

Takes seconds, and its runs a quarter of an hour.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from fieldrl.figures import field_error_figure, maps, style
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import variations


def plan(settings: Settings) -> dict[str, Wanted]:
    """The runs of figure 3."""
    return variations.plan(settings)


def make(settings: Settings) -> None:
    """Find the runs, draw the paths and the fields."""
    runs = experiments.find(plan(settings), settings)
    _make_paths(settings, runs)
    _make_fields(settings, runs[variations.name("global", "step_size", 0.9)])


def greedy_paths(record: xr.Dataset) -> NDArray[np.float64]:
    """The first episode of every replicate's greedy policy, from the start, (r, steps + 1, 2)."""
    paths = record["evaluation_position"].isel(evaluation_episode=0)
    paths = paths.transpose("replicate", "step", "axis").values
    start = np.broadcast_to(record["start"].values, (len(paths), 1, 2))
    return np.concatenate([start, paths], axis=1)


def _make_paths(settings: Settings, runs: dict[str, Found]) -> None:
    """A-C, a row for each estimator."""
    drawing = style.figure(style.PAGE, 5.0, layout="compressed")
    panels = drawing.subplots(2, 3, sharex=True, sharey=True)
    numbers: dict[str, Any] = {}
    level_sets = None
    for row, estimator in enumerate(variations.ESTIMATORS):
        for column, parameter in enumerate(variations.PARAMETERS):
            axes: Axes = panels[row, column]
            first = column == 0
            record = runs[
                variations.name(estimator, parameter, variations.PARAMETERS[parameter].usual)
            ].record
            style.dress(axes)
            maps.prepare(axes, record, first=first)
            field = record["field_true"]
            level_sets = maps.draw_level_sets(axes, field, Normalize(*maps.value_range(field)))
            numbers[f"{estimator} {parameter}"] = _draw_paths(axes, settings, estimator, parameter, runs)
            if row == 0:
                style.letter(axes, "ABC"[column])
                axes.set_xlabel("")
            if first:
                style.title(axes, variations.ESTIMATORS[estimator].title)
            style.legend(axes, "upper left")
    record = runs[variations.name("global", "step_size", 0.9)].record
    if level_sets is not None:
        for axes in panels[:, -1]:
            style.colour_bar(level_sets, axes, maps.bar_label(record, maps.at_final_time(record)))
    artefacts.save(settings, "figure_4", drawing, _paths_caption(record), runs.values(), numbers)


def _draw_paths(
    axes: Axes, settings: Settings, estimator: str, parameter: str, runs: dict[str, Found]
) -> dict[str, NDArray]:
    """The greedy path of every replicate, that of replicate 0 bold; returns them by value."""
    drawn = {}
    for number, value in enumerate(variations.values(parameter, settings)):
        found = greedy_paths(runs[variations.name(estimator, parameter, value)].record)
        colour = style.SERIES[number]
        axes.plot(*found[1:].T, color=colour, linewidth=0.5, alpha=0.6, zorder=3)
        label = f"{variations.PARAMETERS[parameter].symbol} = {value:g}"
        axes.plot(*found[0].T, color="white", linewidth=2.4, zorder=4)
        axes.plot(*found[0].T, color=colour, linewidth=1.4, label=label, zorder=5, marker="o", markersize=2)
        drawn[f"{value:g}"] = found
    axes.plot(*found[0, 0], "D", color=style.VERMILLION, markersize=4, markeredgecolor="white", zorder=6)
    return drawn


def _make_fields(settings: Settings, run: Found) -> None:
    """D: true and estimated feature and their difference at the final time."""
    record = run.record
    drawing = field_error_figure(record)
    difference = record["field_estimate"] - record["field_true"]
    best = record["best_episode"].values.astype(int)
    numbers = {
        "rms": np.sqrt((difference**2).mean(("x", "y")).values),
        "greatest": abs(difference).max(("x", "y")).values,
        "peak": float(record["field_true"].max()),
        "theta": [record["theta"].values[i, b, -1] for i, b in enumerate(best)],
        "best_episode": best,
    }
    artefacts.save(settings, "figure_4d", drawing, _fields_caption(numbers), [run], numbers, "figure_4")


def _paths_caption(record: xr.Dataset) -> str:
    return (
        "Figure 4 A-C. Paths of the greedy policy after learning over the level sets of the true feature at "
        "the final time, for the same variations and both estimators: step size (A), trace decay (B), "
        f"epsilon (C). Bold: replicate 0, with its samples; thin: the other {record.sizes['replicate'] - 1}. "
        "Diamond: start."
    )


def _fields_caption(numbers: dict[str, Any]) -> str:
    low, middle, high = np.percentile(numbers["rms"], [25, 50, 75])
    return (
        "Figure 4D. True feature, the estimate of the best episode of replicate 0 (dots: its samples) and "
        f"their difference at the final time. Over {len(numbers['rms'])} replicates the difference is "
        f"{middle:.2g} [{low:.2g}, {high:.2g}] field units (root mean square), the feature's peak is "
        f"{numbers['peak']:.0f}."
    )


if __name__ == "__main__":
    experiments.command(make)
