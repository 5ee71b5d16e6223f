"""The best episode while it goes: the path so far over the true field at the time of each sample."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from fieldrl.figures import maps, style

_COLUMNS = 4
_MOST = 8  # panels: two full rows


def has_course(record: xr.Dataset) -> bool:
    """Whether the record holds the true field at the times of its samples."""
    return "field_course" in record


def course_figure(record: xr.Dataset, replicate: int = 0) -> Figure:
    """A map for each of some samples of the best episode: the field of that time, the path up to it.

    Args:
        record: a run's record.
        replicate: its index.
    """
    chosen = _chosen(record.sizes["moment"])
    columns = min(len(chosen), _COLUMNS)
    rows = len(chosen) // columns
    width, height = maps.size(record, columns, beside=1.1, above=0.0)
    drawing = style.figure(width, rows * (height + 0.2) + 0.3, layout="compressed")
    grid = drawing.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    norm = Normalize(*maps.value_range(record["field_course"]))
    image = None
    for axes, moment in zip(grid.flat, chosen, strict=True):
        style.dress(axes)
        image = _draw_moment(axes, record, int(moment), replicate, norm)
        _label(axes, axes in grid[:, 0], axes in grid[-1])
    text = style.quantity("True field", record.attrs.get("field_unit", "field unit"))
    style.common_colour_bar(drawing, image, grid, text)
    return drawing


def field_at(record: xr.Dataset, moment: int) -> xr.DataArray:
    """The true field at a moment, with the dimensions x and y."""
    field = record["field_course"].isel(moment=moment)
    return xr.DataArray(
        field.values, dims=("x", "y"), coords={"x": record["course_x"].values, "y": record["course_y"].values}
    )


def best_episode(record: xr.Dataset, replicate: int) -> xr.Dataset:
    """The steps of the best episode of a replicate."""
    best = int(record["best_episode"].isel(replicate=replicate))
    return record.isel(replicate=replicate, episode=best)


def _draw_moment(axes: Axes, record: xr.Dataset, moment: int, replicate: int, norm: Normalize) -> AxesImage:
    """The field of a moment and the path up to its sample."""
    step, episode = int(record["course_step"][moment]), best_episode(record, replicate)
    maps.prepare(axes, record)
    image = maps.draw_field(axes, field_at(record, moment), norm)
    positions = episode["position"].transpose("step", "axis").values[: step + 1]
    maps.draw_path(axes, record["start"].values, positions)
    look = {"markerfacecolor": "none", "markeredgecolor": style.VERMILLION, "markeredgewidth": 1.2}
    axes.plot(*positions[-1], "o", markersize=7, clip_on=False, zorder=8, **look)
    time = float(episode["time"][step])
    taken = f"$t$ = {time:.4g}" if np.isfinite(time) else "not taken"
    style.title(axes, f"sample {step + 1}, {taken}")
    return image


def _chosen(moments: int) -> np.ndarray:
    """Moments, evenly, as many as fill whole rows; the last one always."""
    count = moments if moments < _COLUMNS else min(moments // _COLUMNS * _COLUMNS, _MOST)
    return np.linspace(0, moments - 1, count).round().astype(int) if count > 1 else np.array([moments - 1])


def _label(axes: Axes, first: bool, last: bool) -> None:
    """Leave labels at the outer axes only."""
    axes.tick_params(labelleft=first, labelbottom=last)
    axes.yaxis.label.set_visible(first)
    axes.xaxis.label.set_visible(last)
