"""True field, estimated field and their difference at the final time (after the paper's figure 4D)."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from fieldrl.figures import maps, style


def field_error_figure(record: xr.Dataset, replicate: int = 0) -> Figure:
    """True field, the best episode's estimate and their difference, at the final time.

    True and estimated field share one scale; the difference has its own, symmetric about zero.

    Args:
        record: a run's record.
        replicate: its index.
    """
    true, estimate = record["field_true"], record["field_estimate"].isel(replicate=replicate)
    drawing = style.figure(*maps.size(record, 3), layout="compressed")
    row = style.panels(drawing, 3, shared=True)
    for axes in row:
        maps.prepare(axes, record, first=axes is row[0])
    norm = Normalize(*maps.value_range(true, estimate))
    image = maps.draw_field(row[0], true, norm)
    maps.draw_field(row[1], estimate, norm)
    difference = estimate - true
    change = maps.draw_field(row[2], difference, symmetric(difference), style.DIVERGING)
    unit = record.attrs.get("field_unit", "field unit")
    style.colour_bar(drawing, image, row[:2], style.quantity(maps.at_final_time(record), unit))
    style.colour_bar(drawing, change, row[2:], style.quantity("Difference", unit))
    for axes, text in zip(row, ("True", "Estimated", f"Estimated $-$ true{_size(difference)}"), strict=True):
        style.title(axes, text)
    return drawing


def symmetric(difference: xr.DataArray) -> Normalize:
    """A scale that is symmetric about zero and reaches the greatest finite difference."""
    low, high = maps.value_range(difference, xr.zeros_like(difference))
    reach = max(abs(low), abs(high))
    return Normalize(-reach, reach)


def _size(difference: xr.DataArray) -> str:
    """The root-mean-square difference, as part of a title."""
    rms = float(np.sqrt((difference**2).mean()))
    return f" (rms {rms:.2g})" if np.isfinite(rms) else ""
