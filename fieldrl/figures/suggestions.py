"""The picture of a suggestion: where one sample more would tell most, and which are to be taken."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from fieldrl.figures import maps, style
from fieldrl.mission.suggestion import Suggestion

_PANELS = 3  # times that are drawn at most


def suggestion_figure(suggested: Suggestion) -> Figure:
    """What one sample more would gain, over level lines of the estimated field, with old and new samples.

    A panel for each time that something is suggested at; of more than three, those with the most samples.

    Args:
        suggested: what is drawn.
    """
    record = suggested.record
    times = _times(suggested.times)
    drawing = style.figure(*maps.size(record, len(times), beside=1.35, above=1.0), layout="compressed")
    panels = style.panels(drawing, len(times))
    norm = Normalize(0.0, maps.value_range(suggested.map["gain"])[1])
    image = None
    for axes, time in zip(panels, times, strict=True):
        maps.prepare(axes, record, first=axes is panels[0])
        image = maps.draw_field(axes, suggested.map["gain"].sel(time=time), norm)
        _draw_lines(axes, suggested.map["field"].sel(time=time))
        _draw_samples(axes, suggested, time)
        style.title(axes, f"$t$ = {time:.4g}")
    style.colour_bar(image, panels[-1], "Gain of one sample more [nat]")
    style.legend_across(drawing, panels[0])
    return drawing


def _times(times: np.ndarray) -> list[float]:
    """Those with the most samples, in order."""
    found, counts = np.unique(times, return_counts=True)
    return sorted(found[np.argsort(-counts, kind="stable")[:_PANELS]].tolist())


def _draw_lines(axes: Axes, field: xr.DataArray) -> None:
    """Level lines of the estimated field; none of a constant one."""
    at = maps.levels(field)
    if not at.size:
        return
    values = np.ma.masked_invalid(field.transpose("y", "x").values)
    axes.contour(field.x, field.y, values, levels=at, colors=style.GREY, linewidths=0.6, zorder=2)
    axes.plot([], [], color=style.GREY, linewidth=0.6, label="estimate")


def _draw_samples(axes: Axes, suggested: Suggestion, time: float) -> None:
    """Dots where samples were taken, numbers where the next are to be."""
    record = suggested.record
    old = record["measured_position"].isel(replicate=0, episode=0).transpose("step", "axis").values
    low, high = record.attrs["domain_lower"], record.attrs["domain_upper"]
    maps.draw_samples(axes, old[np.all((old >= low) & (old <= high), axis=1)])
    new = np.flatnonzero(suggested.times == time)
    look = {"color": style.VERMILLION, "markeredgecolor": "white", "markeredgewidth": 0.6, "zorder": 8}
    axes.plot(
        *suggested.positions[new].T, "D", markersize=5, linestyle="none", clip_on=False,
        label="suggested", **look,
    )  # fmt: skip
    for i in new:
        axes.annotate(
            str(i + 1), suggested.positions[i], (4, 3), textcoords="offset points", zorder=9,
            fontsize=style.SMALL, fontweight="bold", color=style.INK,
            bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.75},
        )  # fmt: skip
