"""Pictures of a sweep's results: a line with its spread where one key varies, a heat map where two do.

| symbol | meaning | shape |
|--------|---------|-------|
| n | values of a key | |
| r | results at a value: replicates and seeds | |
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator
from numpy.typing import NDArray

from fieldrl.figures import curves, style

_NUMBERED = 80  # cells of a heat map that have room for their numbers
_CROWDED = 12  # values of a key beyond which not each has a tick of its own


def line_figure(key: str, at: Sequence[str], results: Sequence[Sequence[float]], name: str) -> Figure:
    """The results at each value of one key: every result, their median and interquartile range.

    Args:
        key: its name.
        at: its values as text, (n,); placed by size where all of them are numbers.
        results: at each value, (n, r of each); none where every job failed.
        name: of the results.
    """
    drawing = style.figure(style.COLUMN, 2.4)
    (axes,) = style.panels(drawing, 1)
    at, results = ordered(at, results)
    x = place(axes, at)
    values = _columns(results)
    decades = curves.decades(values)
    if decades > curves.DECADES:
        style.logarithmic(axes, decades)
    if all(number(text) is not None for text in at):
        curves.draw_band(axes, x, values, "median")
    else:
        _draw_side_by_side(axes, x, values)
    look = {"color": style.GREY, "markersize": 2.5, "markeredgewidth": 0, "zorder": 4}
    axes.plot(np.broadcast_to(x, values.shape).T, values.T, "o", **look)
    style.open_frame(axes)
    style.label(axes, key, name)
    style.legend_across(drawing, axes)
    return drawing


def heat_map_figure(
    keys: tuple[str, str],
    at: tuple[Sequence[str], Sequence[str]],
    results: Sequence[Sequence[Sequence[float]]],
    name: str,
) -> Figure:
    """The median result at every pair of values of two keys.

    Args:
        keys: their names: the one along y, the one along x.
        at: their values as text, (m,) and (n,).
        results: at each pair, (m, n, r of each); an empty cell where every job failed.
        name: of the results.
    """
    rows, columns = at
    middle = np.array([[np.median(cell) if len(cell) else np.nan for cell in row] for row in results])
    height = float(np.clip(0.9 + 0.32 * len(rows), 1.6, 5.0))
    drawing = style.figure(style.COLUMN, height)
    (axes,) = style.panels(drawing, 1)
    image = axes.imshow(np.ma.masked_invalid(middle), cmap=style.LEVEL_FILLS, aspect="auto", origin="lower")
    axes.set_xticks(range(len(columns)), columns)
    axes.set_yticks(range(len(rows)), rows)
    if len(columns) > 6:
        axes.tick_params(axis="x", labelrotation=45)
    if middle.size <= _NUMBERED:
        _write_numbers(axes, middle)
    style.colour_bar(image, axes, name)
    style.label(axes, keys[1], keys[0])
    return drawing


def ordered(at: Sequence[str], results: Sequence[Sequence[float]]) -> tuple[list[str], list[Sequence[float]]]:
    """Values and results by size of the values where these are numbers, as they are otherwise."""
    pairs = list(zip(at, results, strict=True))
    if all(number(text) is not None for text in at):
        pairs.sort(key=lambda pair: float(pair[0]))
    return [text for text, _ in pairs], [found for _, found in pairs]


def place(axes: Axes, at: Sequence[str]) -> NDArray[np.float64]:
    """Places of values along the x axis, (n,), with ticks: numbers where they are, words side by side."""
    numbers = [number(text) for text in at]
    if any(value is None for value in numbers):
        places = np.arange(len(at), dtype=float)
    else:
        places = np.array(numbers, dtype=float)
        if (places > 0).all() and curves.decades(places) > curves.DECADES:
            axes.set_xscale("log")
            axes.xaxis.set_minor_locator(NullLocator())
            axes.xaxis.set_minor_formatter(NullFormatter())
    if len(at) <= _CROWDED:
        axes.set_xticks(places, at)
    return places


def number(text: str) -> float | None:
    """A value as a finite number; None where it is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def _draw_side_by_side(axes: Axes, x: NDArray[np.float64], values: NDArray[np.float64]) -> None:
    """Median and interquartile range at words, which nothing lies between."""
    low, median, high = curves.quartiles(values)
    axes.errorbar(
        x, median, (median - low, high - median), fmt="none", ecolor=style.BLUE, elinewidth=6, alpha=0.22,
        label="interquartile range", zorder=2,
    )  # fmt: skip
    axes.plot(x, median, "o", color=style.BLUE, markersize=4, label="median", zorder=3)
    axes.set_xlim(-0.5, x.size - 0.5)


def _columns(results: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """Results of unequal numbers as columns (r, n), NaN where there are fewer."""
    values = np.full((max((len(found) for found in results), default=0) or 1, len(results)), np.nan)
    for column, found in zip(values.T, results, strict=True):
        column[: len(found)] = found
    return values


def _write_numbers(axes: Axes, middle: NDArray[np.float64]) -> None:
    for (i, j), value in np.ndenumerate(middle):
        text = f"{value:.3g}" if np.isfinite(value) else "failed"
        axes.text(j, i, text, ha="center", va="center", fontsize=style.SMALL, color=style.INK)
