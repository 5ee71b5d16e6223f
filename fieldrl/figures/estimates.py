"""The pictures of an estimate from given samples: the field with the samples, residuals, and the fit."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from fieldrl.figures import maps, style


def is_estimate(record: xr.Dataset) -> bool:
    """Whether a record is that of an estimate from given samples."""
    return record.attrs.get("kind") == "estimate"


def field_figure(record: xr.Dataset) -> Figure:
    """The estimated field at the time of the last sample, and where all samples were taken.

    Args:
        record: of an estimate.
    """
    field, samples = record["field_estimate"].isel(replicate=0), _samples(record)
    drawing = style.figure(*maps.size(record, 1, beside=1.35, above=0.75), layout="compressed")
    (axes,) = style.panels(drawing, 1)
    maps.prepare(axes, record)
    image = maps.draw_field(axes, field, Normalize(*maps.value_range(field)))
    positions = samples["measured_position"].transpose("step", "axis").values
    low, high = record.attrs["domain_lower"], record.attrs["domain_upper"]
    maps.draw_samples(axes, positions[np.all((positions >= low) & (positions <= high), axis=1)])
    style.colour_bar(image, axes, maps.bar_label(record, f"Estimate, $t$ = {record.attrs['field_time']:.4g}"))
    style.title(axes, f"{samples.sizes['step']} samples")
    return drawing


def fit_figure(record: xr.Dataset) -> Figure:
    """Prediction against value, with the line where they are equal.

    Args:
        record: of an estimate.
    """
    samples = _samples(record)
    value, below = samples["value"].values, samples["censored"].values > 0
    prediction = value + samples["residual"].values
    drawing = style.figure(style.COLUMN, style.COLUMN)
    (axes,) = style.panels(drawing, 1)
    style.open_frame(axes)
    low, high = maps.value_range(xr.DataArray(np.concatenate([value, prediction])))
    axes.plot([low, high], [low, high], color=style.INK, linewidth=0.6, zorder=1)
    _draw_values(axes, value, prediction, below)
    unit = record.attrs.get("field_unit", "field unit")
    style.label(axes, style.quantity("Value", unit), style.quantity("Prediction", unit))
    last = samples.isel(step=-1)
    style.title(axes, f"$e_f$ = {float(last['e_f']):.3g}, $e_{{cv}}$ = {float(last['e_cv']):.3g}")
    if below.any():
        style.legend(axes)
    return drawing


def _draw_values(axes: Axes, value: np.ndarray, prediction: np.ndarray, below: np.ndarray) -> None:
    look = {"linestyle": "none", "markersize": 3.0, "zorder": 2}
    axes.plot(
        value[~below], prediction[~below], "o", color=style.INK, markeredgewidth=0, label="value", **look
    )
    if below.any():
        axes.plot(
            value[below], prediction[below], "<", color=style.VERMILLION, label="detection limit", **look
        )


def _samples(record: xr.Dataset) -> xr.Dataset:
    """The only episode."""
    return record.isel(replicate=0, episode=0)
