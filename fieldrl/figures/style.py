"""One look for every figure: sizes, colours, axes and labels.

Nothing here touches matplotlib's global state (no pyplot, no rcParams), so figures can be drawn in any
thread. Line colours are those of Okabe and Ito, the maps are cmocean's: both are safe for readers who
are colour-blind, and in grey.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.figure import Figure

with warnings.catch_warnings():  # cmocean 4 calls matplotlib 3.11 in a way that 3.13 will refuse
    warnings.simplefilter("ignore", DeprecationWarning)
    from cmocean import cm

COLUMN = 3.5  # width of one column [inch]
PAGE = 7.2  # width of two columns [inch]
DPI = 150
TEXT, SMALL = 8.0, 7.0  # type sizes [point]
INK, GREY, PALE = "#222222", "#8a8a8a", "#d9d9d9"
BLUE, VERMILLION = "#0072B2", "#D55E00"
DIVERGING: Colormap = cm.balance
_DIMENSIONLESS = ("", "1", "dimensionless")


def _sequential() -> Colormap:
    """cmocean's matter without its darkest fifth, on which ink would be lost."""
    return LinearSegmentedColormap.from_list("matter_light", cm.matter([i / 255 * 0.82 for i in range(256)]))


SEQUENTIAL: Colormap = _sequential()


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


def legend(axes: Axes, location: str = "best") -> None:
    """A frameless legend of the labelled artists."""
    handles = axes.legend(
        loc=location, fontsize=SMALL, frameon=False, labelcolor=INK, handlelength=1.6, borderaxespad=0.2
    )
    handles.set_zorder(10)


def colour_bar(drawing: Figure, mappable, beside: Sequence[Axes], text: str) -> Colorbar:
    """A slim colour bar at the right of the axes, labelled with quantity and unit."""
    bar = drawing.colorbar(mappable, ax=list(beside), aspect=18, pad=0.02, fraction=0.05)
    bar.ax.tick_params(labelsize=SMALL, width=0.6, length=2.5, color=INK, labelcolor=INK, pad=2)
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
