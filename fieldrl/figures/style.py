"""One look for every figure: sizes, colours, axes and labels.

Nothing here touches matplotlib's global state (no pyplot, no rcParams), so figures can be drawn in any
thread. Line colours are those of Okabe and Ito, the maps are cmocean's: both are safe for readers who
are colour-blind, and in grey.
"""

from __future__ import annotations

import math
import re
import warnings
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

with warnings.catch_warnings():  # cmocean 4 calls matplotlib 3.11 in a way that 3.13 will refuse
    warnings.simplefilter("ignore", DeprecationWarning)
    from cmocean.cm import cmap_d as _MAPS

COLUMN = 3.5  # width of one column [inch]
PAGE = 7.2  # width of two columns [inch]
DPI = 150
TEXT, SMALL = 7.5, 7.0  # type sizes [point]
INK, GREY, PALE = "#222222", "#8a8a8a", "#d9d9d9"
BLUE, VERMILLION = "#0072B2", "#D55E00"
SERIES = (
    BLUE,
    "#E69F00",
    "#009E73",
    "#CC79A7",
)  # of curves that are compared; vermillion is for what is expected
DASHES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.5)),
    (0, (1.5, 1)),
    (0, (4, 1, 1, 1)),
)  # that tell them apart in grey
E_TOTAL = "$e_{\\mathrm{total}}$"
_LEGEND: dict[str, Any] = {"fontsize": SMALL, "labelcolor": INK, "handlelength": 1.6, "borderaxespad": 0.2}
_DIMENSIONLESS = ("", "1", "dimensionless")


def _blend(colours: Colormap, name: str, darkest: float, white: float) -> Colormap:
    """``colours`` up to the share ``darkest``, mixed with ``white``, so that ink stays legible on it."""
    rgb = colours(np.linspace(0.0, darkest, 256))[:, :3]
    return LinearSegmentedColormap.from_list(name, (1 - white) * rgb + white)


SEQUENTIAL: Colormap = _blend(_MAPS["dense"], "field", 0.85, 0.0)
LEVEL_LINES: Colormap = _blend(_MAPS["dense"], "level_lines", 0.9, 0.0)
LEVEL_FILLS: Colormap = _blend(_MAPS["dense"], "level_fills", 0.9, 0.55)
DIVERGING: Colormap = _MAPS["balance"]


def figure(width: float, height: float, layout: str = "constrained") -> Figure:
    """An empty figure [inch] on an Agg canvas; ``layout="compressed"`` for maps of equal aspect."""
    drawing = Figure(figsize=(width, height), dpi=DPI, facecolor="white", layout=layout)  # pyright: ignore[reportArgumentType]
    FigureCanvasAgg(drawing)
    return drawing


def panels(drawing: Figure, columns: int, *, shared: bool = False) -> list[Axes]:
    """A row of ``columns`` axes in the house style; ``shared`` ones have common x and y scales."""
    row = drawing.subplots(1, columns, squeeze=False, sharex=shared, sharey=shared)[0]
    for axes in row:
        dress(axes)
    return list(row)


def dress(axes: Axes) -> None:
    """Thin spines, small outward ticks, small type."""
    axes.tick_params(which="both", labelsize=SMALL, width=0.6, length=2.5, color=INK, labelcolor=INK, pad=2)
    axes.tick_params(which="minor", length=1.5, width=0.4)
    for spine in axes.spines.values():
        spine.set_linewidth(0.6)
        spine.set_color(INK)


def count_along_x(axes: Axes) -> None:
    """Ticks at whole numbers only, few of them, on an x axis that counts something."""
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10], integer=True, min_n_ticks=1))


def open_frame(axes: Axes) -> None:
    """Leave out the upper and the right spine, as curves need only two."""
    axes.spines[["top", "right"]].set_visible(False)


def label(axes: Axes, x: str = "", y: str = "") -> None:
    """Name the axes."""
    axes.set_xlabel(x, fontsize=TEXT, color=INK, labelpad=2)
    axes.set_ylabel(y, fontsize=TEXT, color=INK, labelpad=2)


def title(axes: Axes, text: str) -> None:
    """A title at the left, as wide as it needs to be."""
    axes.set_title(text, fontsize=TEXT, color=INK, loc="left", pad=4, linespacing=1.25)


def letter(axes: Axes, text: str) -> None:
    """The panel's letter, bold, left of its upper corner."""
    look: dict[str, Any] = {"fontsize": TEXT + 1, "fontweight": "bold", "color": INK}
    axes.annotate(text, (0, 1), (-4, 5), "axes fraction", "offset points", ha="right", va="bottom", **look)


def legend(axes: Axes, location: Any = "best") -> None:
    """A frameless legend of the labelled artists, inside the axes."""
    axes.legend(loc=location, frameon=False, **_LEGEND).set_zorder(10)


def legend_above(drawing: Figure, axes: Axes) -> None:
    """A legend of the labelled artists of ``axes`` in one row, at the figure's upper right corner."""
    handles, names = axes.get_legend_handles_labels()
    look = _LEGEND | {"handlelength": 0.8, "columnspacing": 1.0}
    drawing.legend(handles, names, loc="upper right", ncols=len(names), frameon=False, **look)


def legend_across(drawing: Figure, axes: Axes) -> None:
    """A legend of the labelled artists of ``axes`` above all axes, where it hides nothing, five in a row."""
    handles, names = axes.get_legend_handles_labels()
    if names:
        columns = math.ceil(len(names) / math.ceil(len(names) / 5))
        drawing.legend(handles, names, loc="outside upper center", ncols=columns, frameon=False, **_LEGEND)


def logarithmic(axes: Axes, decades: float) -> None:
    """A logarithmic y axis over so many ``decades``; ticks read as plain numbers, at 1, 2 and 5 where few."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2.5 else (1.0,)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
    axes.yaxis.set_minor_formatter(NullFormatter())


def plain(value: float) -> str:
    """``value`` as people write it: 0.02, 500, and powers of ten beyond."""
    if 1e-3 <= value < 1e5:
        return f"{value:g}"
    exponent = math.floor(math.log10(value) + 1e-9)
    factor = round(value / 10.0**exponent)
    return f"$10^{{{exponent}}}$" if factor == 1 else f"{factor}$\\times 10^{{{exponent}}}$"


def colour_bar(mappable, axes: Axes, text: str) -> Colorbar:
    """A slim colour bar as tall as ``axes``, at its right, labelled with quantity and unit."""
    bar = axes.figure.colorbar(mappable, cax=axes.inset_axes((1.04, 0.0, 0.045, 1.0)))
    bar.ax.tick_params(which="both", labelsize=SMALL, width=0.6, length=2.5, color=INK, labelcolor=INK, pad=2)
    bar.ax.minorticks_off()
    if isinstance(mappable, ContourSet):
        levels = list(mappable.levels)
        bar.set_ticks(levels[:: math.ceil(len(levels) / 5)])
    bar.outline.set_linewidth(0.6)  # pyright: ignore[reportCallIssue, reportAttributeAccessIssue]
    bar.set_label(text, fontsize=TEXT, color=INK)
    return bar


def common_colour_bar(drawing: Figure, mappable, axes, text: str) -> Colorbar:
    """One colour bar at the right of an array of axes, labelled with quantity and unit."""
    bar = drawing.colorbar(mappable, ax=axes, pad=0.015, aspect=30, fraction=0.05)
    bar.ax.tick_params(which="both", labelsize=SMALL, width=0.6, length=2.5, color=INK, labelcolor=INK, pad=2)
    bar.outline.set_linewidth(0.6)  # pyright: ignore[reportCallIssue, reportAttributeAccessIssue]
    bar.set_label(text, fontsize=TEXT, color=INK)
    return bar


def quantity(name: str, unit: str) -> str:
    """``name [unit]`` with powers raised; the bare name where it has no dimension."""
    if unit in _DIMENSIONLESS:
        return name
    power = re.fullmatch(r"([\w ]+ \w+)\^(-?\d+)", unit)
    unit = f"({power[1]})^{power[2]}" if power else unit
    raised = re.sub(r"\^(-?[0-9]+)", _raised, unit)
    return f"{name} [{raised}]"


def _raised(power: re.Match[str]) -> str:
    return f"$^{{{power[1]}}}$"
