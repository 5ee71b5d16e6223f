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


def size(record: xr.Dataset, panels: int, beside: float, above: float) -> tuple[float, float]:
    """Width and height of a row of maps [inch].

    Args:
        record: tells the shape of the domain.
        panels: how many maps.
        beside: width of all labels and colour bars.
        above: height of titles and labels.
    """
    width, height = np.subtract(record.attrs["domain_upper"], record.attrs["domain_lower"])
    page = style.PAGE if panels > 1 else style.COLUMN
    return page, float(np.clip((page - beside) / panels * height / width, 0.8, 7.0)) + above


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


def true_field(record: xr.Dataset, replicate: int) -> xr.DataArray:
    """The true field at the final time (x, y); that of a replicate's best episode where truths vary."""
    field = record["field_true"]
    return field.isel(replicate=replicate) if "replicate" in field.dims else field


def draw_field(axes: Axes, field: xr.DataArray, norm: Normalize, colours=style.SEQUENTIAL) -> AxesImage:
    """A field (x, y) given at cell centres, each cell as a patch of colour."""
    values = field.transpose("y", "x").values
    return axes.imshow(values, origin="lower", extent=_extent(field), norm=norm, cmap=colours, zorder=0)


def draw_level_sets(axes: Axes, field: xr.DataArray, norm: Normalize) -> QuadContourSet | None:
    """Level sets of a field (x, y) over pale fills; returns the fills, None for a constant field."""
    at = levels(field)
    if not at.size:
        return None
    field = field.isel(x=_thinned(field.x.size), y=_thinned(field.y.size)).transpose("y", "x")
    where = (field.x.values, field.y.values, np.ma.masked_invalid(field.values))
    axes.contour(*where, levels=at, norm=norm, cmap=style.LEVEL_LINES, linewidths=0.7, zorder=1)
    return axes.contourf(*where, levels=at, norm=norm, cmap=style.LEVEL_FILLS, extend="max", zorder=0)


def draw_path(axes: Axes, start: NDArray, positions: NDArray) -> None:
    """A path from ``start`` (2,) through the ``positions`` (steps, 2) of its samples."""
    x, y = np.vstack([start, positions]).T
    axes.plot(x, y, color="white", linewidth=2.2, zorder=4)
    axes.plot(x, y, color=style.INK, linewidth=0.9, zorder=5)
    draw_samples(axes, positions)
    edge = {"markeredgecolor": "white", "markeredgewidth": 0.6}
    axes.plot(
        *start, "D", color=style.VERMILLION, markersize=5, label="start", clip_on=False, zorder=7, **edge
    )


def draw_samples(axes: Axes, positions: NDArray) -> None:
    """A dot at each of the ``positions`` (steps, 2)."""
    look = {"color": style.INK, "markersize": 2.6, "markeredgewidth": 0}
    axes.plot(*positions.T, "o", label="sample", clip_on=False, zorder=6, **look)


def levels(field: xr.DataArray, count: int = LEVELS) -> NDArray[np.float64]:
    """About ``count`` round values well inside the range of ``field``, (k,); none for a constant field.

    Values within 2 % of the range from its ends are left out: there, level sets show only rounding.
    """
    values = np.asarray(field)
    values = values[np.isfinite(values)]
    if not values.size or np.ptp(values) <= 1e-9 * np.abs(values).max():
        return np.empty(0)
    low, high, margin = values.min(), values.max(), 0.02 * np.ptp(values)
    ticks = MaxNLocator(count).tick_values(low, high)
    return ticks[(ticks > low + margin) & (ticks < high - margin)]


def value_range(*fields: xr.DataArray) -> tuple[float, float]:
    """Least and greatest finite value of all fields; they always differ, so that a scale exists."""
    values = np.concatenate([np.ravel(field) for field in fields])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    return (low, high) if high - low > 1e-9 * max(abs(low), abs(high)) else (low, low + 1.0)


def bar_label(record: xr.Dataset, name: str) -> str:
    """``name`` and the field's unit, on two lines where the maps are low."""
    width, height = np.subtract(record.attrs["domain_upper"], record.attrs["domain_lower"])
    text = style.quantity(name, record.attrs.get("field_unit", "field unit"))
    return text.replace(" [", "\n[") if width > 1.4 * height else text


def at_final_time(record: xr.Dataset) -> str:
    """``f(x, t = T)``, T the time of the last sample."""
    final = float(record["time"].max()) if record["time"].size else 0.0
    return f"$f(\\mathbf{{x}},\\, t$ = {final:.4g})"


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
