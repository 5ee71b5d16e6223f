"""Residuals along time, against the noise: of a mission's samples, and of an estimate from given samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fieldrl.figures import style


def has_residuals(record: xr.Dataset) -> bool:
    """Whether a mission's record has the residuals of its samples."""
    return "pooled_residual" in record and bool(np.isfinite(record["pooled_residual"]).any())


def mission_residuals_figure(record: xr.Dataset) -> Figure:
    """All samples of the first replicate at the estimate from all of them: along time, and beside the noise.

    Args:
        record: of a run.
    """
    first = record.isel(replicate=0)
    residual = first["pooled_residual"].transpose("episode", "step").values
    time, noise = first["time"].transpose("episode", "step").values, float(record.attrs["noise"])
    drawing = style.figure(style.PAGE, 2.4)
    left, right = drawing.subplots(1, 2, width_ratios=(2, 1))
    for axes in (left, right):
        style.dress(axes)
        style.open_frame(axes)
    best = int(first["best_episode"])
    _draw_noise(left, noise)
    _draw_points(
        left,
        time,
        residual,
        style.INK,
        "all samples",
        alpha=max(0.05, 0.8 / len(residual) ** 0.5),
        markeredgewidth=0,
    )
    _draw_points(left, time[best], residual[best], style.VERMILLION, "best episode")
    _label(left, record)
    _draw_density(right, residual[np.isfinite(residual)], noise)
    style.label(right, style.quantity("Prediction \u2212 value", _unit(record)), "Density")
    style.legend_across(drawing, left)
    return drawing


def estimate_residuals_figure(record: xr.Dataset) -> Figure:
    """Prediction minus value along time, of the fit and of the fits without each sample.

    Args:
        record: of an estimate.
    """
    samples, noise = record.isel(replicate=0, episode=0), float(record.attrs["noise"])
    drawing = style.figure(style.PAGE, 2.4)
    (axes,) = style.panels(drawing, 1)
    style.open_frame(axes)
    time = samples["time"].values
    _draw_noise(axes, noise)
    left_out = samples["residual_left_out"].values
    _draw_points(axes, time, left_out, style.VERMILLION, "left out", fillstyle="none")
    _draw_points(axes, time, samples["residual"].values, style.INK, "fitted")
    _label(axes, record)
    style.legend_across(drawing, axes)
    return drawing


def _draw_noise(axes: Axes, noise: float) -> None:
    """Where nineteen of twenty residuals should be, if the noise was stated."""
    if np.isfinite(noise) and noise > 0:
        band = 2 * noise
        axes.axhspan(-band, band, color="0.92", zorder=0, label="two standard deviations of the noise")
    axes.axhline(0.0, color=style.INK, linewidth=0.6, zorder=1)


def _draw_points(axes: Axes, time: NDArray, residual: NDArray, colour: str, text: str, **look: Any) -> None:
    look = {"color": colour, "markersize": 3.0, "markeredgewidth": 0.6} | look
    axes.plot(np.ravel(time), np.ravel(residual), "o", label=text, **look)


def _draw_density(axes: Axes, residual: NDArray, noise: float) -> None:
    """Histogram of residuals, and the normal density of the noise."""
    axes.hist(residual, bins="auto" if len(residual) > 20 else 8, density=True, color=style.PALE)
    if noise > 0:
        x = np.linspace(*axes.get_xlim(), 200)
        axes.plot(
            x, np.exp(-0.5 * (x / noise) ** 2) / (noise * np.sqrt(2 * np.pi)), color=style.INK, linewidth=1.0
        )


def _label(axes: Axes, record: xr.Dataset) -> None:
    time = style.quantity("Time", record.attrs.get("time_unit", "time"))
    style.label(axes, time, style.quantity("Prediction \u2212 value", _unit(record)))


def _unit(record: xr.Dataset) -> str:
    return record.attrs.get("field_unit", "field unit")
