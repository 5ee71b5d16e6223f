"""Pictures of a search of configuration values: its course, and how the objective depends on each key.

| symbol | meaning | shape |
|--------|---------|-------|
| n | trials, in their order; None where a job failed | |
| d | keys that were searched | |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fieldrl.figures import curves, style

_IN_A_ROW = 3


@dataclass(frozen=True)
class Panel:
    """One key that was searched.

    Args:
        key: its name.
        tried: its value at every trial, (n,); of choices, their places in the list.
        places: where the surrogate was asked, (k,).
        mean: its mean there, (k,) [of the objective].
        log: whether its logarithm was searched.
        choices: names of the places; empty for numbers.
    """

    key: str
    tried: Sequence[float]
    places: Sequence[float]
    mean: Sequence[float]
    log: bool = False
    choices: Sequence[str] = ()


def convergence_figure(values: Sequence[float | None], sign: float, name: str, initial: int) -> Figure:
    """Every trial and the best so far.

    Args:
        values: of the objective, (n,), None where a job failed.
        sign: 1 where less is better, -1 where more is.
        name: of the objective.
        initial: trials of the initial design.
    """
    drawing = style.figure(style.COLUMN, 2.5)
    (axes,) = style.panels(drawing, 1)
    known = _array(values)
    trials = np.arange(1, known.size + 1)
    decades = curves.decades(known) if (known[np.isfinite(known)] > 0).all() else 0.0
    if decades > curves.DECADES:
        style.logarithmic(axes, decades)
    axes.plot(trials, known, "o", color=style.GREY, markersize=3, markeredgewidth=0, label="trial", zorder=2)
    best = sign * np.fmin.accumulate(sign * known)
    axes.plot(trials, best, drawstyle="steps-post", color=style.BLUE, linewidth=1.4, label="best", zorder=3)
    _mark_failures(axes, trials[np.isnan(known)])
    if initial < known.size:
        axes.axvline(initial + 0.5, color=style.PALE, linewidth=0.8, label="end of design", zorder=1)
    style.open_frame(axes)
    style.count_along_x(axes)
    style.label(axes, "Trial", name)
    style.legend_across(drawing, axes)
    return drawing


def dependence_figure(panels: Sequence[Panel], values: Sequence[float | None], name: str) -> Figure:
    """Every trial over each key, and the surrogate's mean over all other keys.

    Args:
        panels: one for each key, (d,).
        values: of the objective, (n,), None where a job failed.
        name: of the objective.
    """
    columns = min(len(panels), _IN_A_ROW)
    rows = math.ceil(len(panels) / columns)
    width = style.COLUMN if columns == 1 else style.PAGE
    drawing = style.figure(width, 2.2 * rows + 0.2)
    grid = drawing.subplots(rows, columns, squeeze=False, sharey=True)
    for i, axes in enumerate(grid.flat):
        if i >= len(panels):
            axes.set_visible(False)
            continue
        style.dress(axes)
        _draw_panel(axes, panels[i], _array(values))
        style.label(axes, panels[i].key, name if i % columns == 0 else "")
    style.legend_across(drawing, grid[0, 0])
    return drawing


def _draw_panel(axes: Axes, panel: Panel, values: NDArray[np.float64]) -> None:
    if panel.log:
        axes.set_xscale("log")
    look = {"color": style.GREY, "markersize": 3, "markeredgewidth": 0, "label": "trial", "zorder": 2}
    axes.plot(panel.tried, values, "o", **look)
    if len(panel.places):
        shape = "s" if panel.choices else "-"
        look = {
            "color": style.BLUE,
            "linewidth": 1.4,
            "markersize": 4,
            "label": "surrogate, mean over the rest",
        }
        axes.plot(panel.places, panel.mean, shape, **look, zorder=3)
    if panel.choices:
        axes.set_xticks(range(len(panel.choices)), panel.choices)
        axes.set_xlim(-0.5, len(panel.choices) - 0.5)
    style.open_frame(axes)


def _mark_failures(axes: Axes, trials: NDArray) -> None:
    """Crosses at the lower edge."""
    if trials.size:
        look = {"color": style.VERMILLION, "markersize": 4, "label": "failed", "clip_on": False}
        axes.plot(trials, np.zeros(trials.size), "x", transform=axes.get_xaxis_transform(), **look)


def _array(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=float)
