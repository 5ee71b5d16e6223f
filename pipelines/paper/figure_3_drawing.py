"""The search behind figure 3 as a picture: pairs of settings, coloured by how many trends seem to hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from fieldrl.figures import style
from fieldrl.sweeps.space import Dimension, Point
from pipelines.paper.figure_3_space import SPACE
from pipelines.paper.figure_3_trends import TRENDS

_PAIRS = (
    ("v_max", "time step"), ("start x", "start y"), ("centre", "side"),
    ("bound", "tikhonov"), ("phi", "gamma"), ("initial value", "starts"),
)  # fmt: skip
_JITTER = 0.18  # of values that are choices, so that points do not hide each other


def draw(
    points: Sequence[Point],
    seen: Sequence[Mapping[str, bool]],
    chance: Sequence[Mapping[str, bool]],
    judged: Sequence[Point],
) -> Figure:
    """Pairs of settings, and how many points show how many trends.

    Args:
        points: that were tried.
        seen: which trends seem to hold at each.
        chance: the same with agents that act at random, at some of them.
        judged: points that are ringed.
    """
    drawing = style.figure(style.PAGE, 4.2)
    panels = drawing.subplots(2, 4)
    counts = np.array([sum(each.values()) for each in seen])
    for axes, pair, letter in zip(panels[:, :3].ravel(), _PAIRS, "ABCDEF", strict=True):
        style.letter(axes, letter)
        image = _pair(axes, pair, points, counts, judged)
    bar = drawing.colorbar(
        image, ax=panels[:, :3], location="bottom", aspect=50, pad=0.02, ticks=range(len(TRENDS) + 1)
    )
    bar.ax.tick_params(labelsize=style.SMALL)
    bar.set_label("trends that seem to hold", fontsize=style.TEXT)
    _bars(panels[0, 3], {"learners": counts, "at random": np.array([sum(each.values()) for each in chance])})
    _shares(panels[1, 3], seen, chance)
    for axes, letter in zip(panels[:, 3], "GH", strict=True):
        style.letter(axes, letter)
    return drawing


def _pair(
    axes: Axes, pair: tuple[str, str], points: Sequence[Point], counts: Any, judged: Sequence[Point]
) -> Any:
    style.dress(axes)
    x, y = (_values(name, points) for name in pair)
    starts = np.array([point[SPACE.keys.index("starts")] for point in points])
    norm = BoundaryNorm(np.arange(len(TRENDS) + 2) - 0.5, style.SEQUENTIAL.N)
    look: dict[str, Any] = {
        "cmap": style.SEQUENTIAL,
        "norm": norm,
        "s": 16,
        "linewidths": 0.4,
        "edgecolors": style.INK,
    }
    for start, marker in ((0, "o"), (1, "^")):
        at = starts == start
        image = axes.scatter(x[at], y[at], c=counts[at], marker=marker, **look)
    ringed = np.array([point in judged for point in points])
    axes.scatter(x[ringed], y[ringed], s=55, facecolors="none", edgecolors=style.VERMILLION, linewidths=0.8)
    for name, axis, limits in zip(
        pair, (axes.xaxis, axes.yaxis), (axes.set_xlim, axes.set_ylim), strict=True
    ):
        if SPACE.dimensions[SPACE.keys.index(name)].log:
            (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
        limits(*_scale(SPACE.dimensions[SPACE.keys.index(name)], axis))
    style.label(axes, *pair)
    return image


def _scale(dimension: Dimension, axis: Axis) -> tuple[float, float]:
    """Ticks that a setting needs along an axis; returns its limits."""
    if dimension.choices:
        axis.set_ticks(range(len(dimension.choices)), dimension.choices)
        return -0.5, len(dimension.choices) - 0.5
    margin = 0.05 * (dimension.high - dimension.low)
    if not dimension.log:
        return dimension.low - margin, dimension.high + margin
    axis.set_major_locator(
        LogLocator(subs=(1.0, 2.0, 5.0) if dimension.high < 1e3 * dimension.low else (1.0,))
    )
    axis.set_major_formatter(FuncFormatter(lambda value, _: style.plain(value)))
    axis.set_minor_formatter(NullFormatter())
    return dimension.low / 1.2, dimension.high * 1.2


def _values(name: str, points: Sequence[Point]) -> Any:
    """Of a setting at every point; choices by their place, a little apart."""
    place = SPACE.keys.index(name)
    values = np.array([point[place] for point in points], dtype=float)
    if SPACE.dimensions[place].choices:
        values += _JITTER * np.cos(2.4 * np.arange(len(values)))
    return values


def _bars(axes: Axes, counts: Mapping[str, Any]) -> None:
    """How many points show so many trends, as shares."""
    style.dress(axes)
    style.open_frame(axes)
    for number, (label, each) in enumerate(counts.items()):
        share = np.bincount(each, minlength=len(TRENDS) + 1) / max(1, each.size)
        axes.bar(
            np.arange(share.size) + 0.4 * number - 0.2, share, 0.4, color=style.SERIES[number], label=label
        )
    axes.set_ylim(0, 1.35 * axes.get_ylim()[1])
    style.count_along_x(axes)
    style.label(axes, "trends", "share of points")
    style.legend(axes, "upper right")


def _shares(axes: Axes, seen: Sequence[Mapping[str, bool]], chance: Sequence[Mapping[str, bool]]) -> None:
    """At how many points each trend seems to hold, as shares."""
    style.dress(axes)
    style.open_frame(axes)
    for number, each in enumerate((seen, chance)):
        share = [np.mean([one[trend] for one in each]) for trend in TRENDS]
        axes.barh(np.arange(len(TRENDS)) + 0.4 * number - 0.2, share, 0.4, color=style.SERIES[number])
    axes.set_yticks(range(len(TRENDS)), TRENDS)
    axes.invert_yaxis()
    style.label(axes, "share of points")
