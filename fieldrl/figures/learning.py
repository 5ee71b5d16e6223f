"""Learning curve: return and total error of every episode (after figure 3)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fieldrl.figures import curves, style

_LONGEST = 51  # episodes in the longest rolling mean


def learning_curve_figure(record: xr.Dataset) -> Figure:
    """Return and e_total (Eq. 7, after the last sample) of every episode.

    One replicate: each episode, thin, and the rolling mean. Several: the median and the interquartile range,
    over the replicates, of the rolling means.
    """
    drawing = style.figure(style.PAGE, 2.65)
    left, right = style.panels(drawing, 2)
    draw_return(left, record)
    draw_total_error(right, record)
    style.legend_across(drawing, right)
    return drawing


def compared_figure(records: Mapping[str, xr.Dataset]) -> Figure:
    """Total error of the episodes of up to four runs: rolling means, their median and quartiles.

    Args:
        records: by name.
    """
    drawing = style.figure(style.PAGE, 2.65)
    (axes,) = style.panels(drawing, 1)
    for number, (name, record) in enumerate(records.items()):
        errors = record["e_total"].isel(step=-1).transpose("replicate", "episode").values
        values = curves.rolling_mean(errors, window(errors.shape[1]))
        curves.draw_compared(axes, curves.episode_numbers(record), values, name, number)
    shown = np.concatenate([line.get_ydata() for line in axes.lines])
    if (decades := curves.decades(shown)) > curves.DECADES:
        style.logarithmic(axes, decades)
    style.open_frame(axes)
    style.count_along_x(axes)
    style.label(axes, "Episode", f"Total error {style.E_TOTAL}")
    style.legend_across(drawing, axes)
    return drawing


def draw_return(axes: Axes, record: xr.Dataset) -> None:
    """Return of every episode."""
    _draw(axes, record, record["return"].transpose("replicate", "episode").values)
    style.label(axes, "Episode", style.quantity("Return", record["return"].attrs.get("units", "")))


def draw_total_error(axes: Axes, record: xr.Dataset) -> None:
    """Total error of every episode and, where the noise is known, its expectation 2 sigma^2."""
    errors = record["e_total"].isel(step=-1).transpose("replicate", "episode").values
    shown = errors if len(errors) == 1 else curves.rolling_mean(errors, window(errors.shape[1]))
    decades = curves.decades(shown)
    if decades > curves.DECADES:
        style.logarithmic(axes, decades)
        errors = np.where(errors > 0, errors, np.nan)
    _draw(axes, record, errors)
    draw_expectation(axes, float(record.attrs.get("noise", 0.0)))
    name = f"Total error {style.E_TOTAL}"
    style.label(axes, "Episode", style.quantity(name, record["e_total"].attrs.get("units", "")))


def draw_expectation(axes: Axes, noise: float) -> None:
    """What e_f + e_cv comes to if theta is known exactly: 2 sigma^2 (nothing without noise)."""
    if noise > 0:
        text = f"expected, $2\\sigma^2$ = {2 * noise**2:.3g}"
        look = {"color": style.VERMILLION, "linewidth": 1.0, "linestyle": (0, (4, 2)), "zorder": 4}
        axes.axhline(2 * noise**2, label=text, **look)


def window(episodes: int) -> int:
    """Length of the rolling mean: the odd number next to a tenth of the run, at most 51 episodes."""
    return min(_LONGEST, 2 * (episodes // 20) + 1)


def _draw(axes: Axes, record: xr.Dataset, values: NDArray) -> None:
    """The replicates' series, ``values`` (replicates, episodes)."""
    replicates, length, numbers = len(values), window(values.shape[1]), curves.episode_numbers(record)
    if replicates == 1:
        curves.draw_smoothed(axes, numbers, values[0], length)
    else:
        name = f"median of {replicates} replicates" + (f", rolling mean of {length}" if length > 1 else "")
        curves.draw_band(axes, numbers, curves.rolling_mean(values, length), name)
    style.open_frame(axes)
    style.count_along_x(axes)
    margin = max(0.5, 0.02 * (numbers[-1] - numbers[0]))
    axes.set_xlim(numbers[0] - margin, numbers[-1] + margin)
