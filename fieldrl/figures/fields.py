"""True field, estimated field and their difference at the final time (after figure 4D)."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from fieldrl.figures import curves, maps, style


def has_field(record: xr.Dataset) -> bool:
    """Whether the record holds a field, true or estimated; a model of one's own may have none."""
    return any(np.isfinite(record[name]).any() for name in ("field_estimate", "field_true"))


def field_error_figure(record: xr.Dataset, replicate: int = 0) -> Figure:
    """True field, the best episode's estimate and their difference, at the final time.

    True and estimated field share one scale; the difference has its own, symmetric about zero.

    Args:
        record: a run's record.
        replicate: its index.
    """
    true, estimate = maps.true_field(record, replicate), record["field_estimate"].isel(replicate=replicate)
    drawing = style.figure(*maps.size(record, 3, beside=2.2, above=0.6), layout="compressed")
    row = style.panels(drawing, 3, shared=True)
    for axes in row:
        maps.prepare(axes, record, first=axes is row[0])
    draw_true_and_estimate(row[0], row[1], record, replicate)
    draw_difference(row[2], estimate - true, maps.bar_label(record, "Difference"))
    return drawing


def draw_true_and_estimate(left: Axes, right: Axes, record: xr.Dataset, replicate: int) -> None:
    """The two fields on one scale, its colour bar at the right; the samples on the estimate."""
    true, estimate = maps.true_field(record, replicate), record["field_estimate"].isel(replicate=replicate)
    norm = Normalize(*maps.value_range(true, estimate))
    maps.draw_field(left, true, norm)
    image = maps.draw_field(right, estimate, norm)
    best = int(record["best_episode"].isel(replicate=replicate))
    samples = record["position"].isel(replicate=replicate, episode=best).transpose("step", "axis")
    maps.draw_samples(right, samples.values)
    style.colour_bar(image, right, maps.bar_label(record, maps.at_final_time(record)))
    style.title(left, "True")
    style.title(right, f"Estimated, episode {curves.episode_numbers(record)[best]}")


def draw_difference(axes: Axes, difference: xr.DataArray, text: str) -> None:
    """A difference of two fields (x, y), its bar labelled ``text``, its size in the title."""
    image = maps.draw_field(axes, difference, symmetric(difference), style.DIVERGING)
    style.colour_bar(image, axes, text)
    rms = float(np.sqrt((difference**2).mean()))
    style.title(
        axes, f"Estimated \u2212 true, rms {rms:.2g}" if np.isfinite(rms) else "Estimated \u2212 true"
    )


def symmetric(difference: xr.DataArray) -> Normalize:
    """A scale that is symmetric about zero and reaches the greatest finite difference."""
    low, high = maps.value_range(difference, xr.zeros_like(difference))
    reach = max(abs(low), abs(high))
    return Normalize(-reach, reach)
