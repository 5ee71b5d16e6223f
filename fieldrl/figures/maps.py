"""What every map shares: the extent of the water, obstacles, fields, level sets, paths."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.contour import QuadContourSet
from matplotlib.image import AxesImage
from matplotlib.patches import Circle, Patch, Rectangle
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fieldrl.figures import style

LEVELS = 8  # about as many level sets as are drawn
_FINEST = 256  # cells a side beyond which a level set gains nothing at column width


def size(record: xr.Dataset, panels: int) -> tuple[float, float]:
    """Width and height of a row of maps with their labels [inch]."""
    width, height = np.subtract(record.attrs["domain_upper"], record.attrs["domain_lower"])
    page = style.PAGE if panels > 1 else style.COLUMN
    breadth = (page - 1.2) / panels
    return page, float(np.clip(breadth * height / width, 0.8, 7.0)) + 0.85


def prepare(axes: Axes, record: xr.Dataset, *, first: bool = True) -> None:
    """Equal aspect, the whole domain, its obstacles, units on both axes (y on the ``first`` of a row)."""
    (x0, y0), (x1, y1) = record.attrs["domain_lower"], record.attrs["domain_upper"]
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal")
    ticks = 4 if x1 - x0 < 1.5 * (y1 - y0) else 5
    axes.xaxis.set_major_locator(MaxNLocator(ticks, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    for obstacle in obstacles(record):
        axes.add_patch(obstacle)
    unit = record.attrs.get("length_unit", "length")
    style.label(axes, style.quantity("$x$", unit), style.quantity("$y$", unit) if first else "")
    axes.tick_params(labelleft=first)


def obstacles(record: xr.Dataset) -> list[Patch]:
    """Grey patches of the record's obstacles."""
    return [_patch(each) for each in json.loads(record.attrs.get("obstacles", "[]"))]


def draw_field(axes: Axes, field: xr.DataArray, norm: Normalize, colours=style.SEQUENTIAL) -> AxesImage:
    """A field (x, y) given at cell centres, each cell as a patch of colour."""
    return axes.imshow(
        field.transpose("y", "x").values,
        origin="lower",
        extent=_extent(field),
        norm=norm,
        cmap=colours,
        zorder=0,
    )


def draw_level_sets(
    axes: Axes, field: xr.DataArray, levels: NDArray, norm: Normalize
) -> QuadContourSet | None:
    """The level sets of a field (x, y); None where there is none (a constant field)."""
    if not levels.size:
        return None
    field = field.isel(x=_thinned(field.x.size), y=_thinned(field.y.size)).transpose("y", "x")
    where = (field.x.values, field.y.values, np.ma.masked_invalid(field.values))
    axes.contourf(*where, levels=levels, norm=norm, cmap=style.SEQUENTIAL, alpha=0.3, extend="max", zorder=0)
    return axes.contour(*where, levels=levels, norm=norm, cmap=style.SEQUENTIAL, linewidths=0.8, zorder=1)


def draw_path(axes: Axes, start: NDArray, positions: NDArray) -> None:
    """A path from ``start`` (2,) through the ``positions`` (steps, 2) of its samples."""
    x, y = np.vstack([start, positions]).T
    axes.plot(x, y, color=style.INK, linewidth=0.9, zorder=4, solid_joinstyle="round")
    dots = {
        "markersize": 3.4,
        "markeredgecolor": "white",
        "markeredgewidth": 0.5,
        "zorder": 5,
        "clip_on": False,
    }
    axes.plot(x[1:], y[1:], "o", color=style.INK, label="sample", **dots)
    axes.plot(
        x[:1], y[:1], "D", color=style.VERMILLION, label="start", **dots | {"markersize": 5.0, "zorder": 6}
    )


def levels(field: xr.DataArray, count: int = LEVELS) -> NDArray[np.float64]:
    """About ``count`` round values strictly inside the range of ``field``, (k,); none for a constant field."""
    low, high = value_range(field)
    ticks = MaxNLocator(count).tick_values(low, high)
    finite = np.asarray(field)[np.isfinite(field)]
    if not finite.size:
        return np.empty(0)
    return ticks[(ticks > finite.min()) & (ticks < finite.max())]


def value_range(*fields: xr.DataArray) -> tuple[float, float]:
    """Least and greatest finite value of all fields; they differ by at least a little, so that a scale exists."""
    values = np.concatenate([np.ravel(field) for field in fields])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    return (low, high) if high - low > 1e-9 * max(abs(low), abs(high)) else (low, low + 1.0)


def at_final_time(record: xr.Dataset) -> str:
    """``f(x, t = T)``, T the time of the last sample."""
    final = float(record["time"].max()) if record["time"].size else 0.0
    return f"$f(\\mathbf{{x}},\\,t = {final:.4g})$"


def _patch(obstacle: dict) -> Patch:
    look = {"facecolor": style.PALE, "edgecolor": style.INK, "linewidth": 0.6, "zorder": 3}
    if obstacle["kind"] == "circle":
        return Circle(obstacle["centre"], obstacle["radius"], **look)
    (x0, y0), (x1, y1) = obstacle["lower"], obstacle["upper"]
    return Rectangle((x0, y0), x1 - x0, y1 - y0, **look)


def _extent(field: xr.DataArray) -> tuple[float, float, float, float]:
    """Edges of the outermost cells, half a cell beyond their centres [length]."""
    return (*_edges(field.x.values), *_edges(field.y.values))


def _edges(centres: NDArray) -> tuple[float, float]:
    half = (centres[-1] - centres[0]) / (2 * (centres.size - 1)) if centres.size > 1 else 0.5
    return float(centres[0] - half), float(centres[-1] + half)


def _thinned(cells: int) -> slice:
    return slice(None, None, max(1, cells // _FINEST))
