"""Learning curve: return and total error of every episode (after the paper's figure 3)."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from fieldrl.figures import curves, style

_LONGEST = 50  # episodes in the longest rolling mean


def learning_curve_figure(record: xr.Dataset) -> Figure:
    """Return and e_total (Eq. 7, after the last sample) of every episode.

    One replicate: each episode, thin, and the rolling mean. Several: the median and the interquartile range,
    over the replicates, of the rolling means.
    """
    drawing = style.figure(style.PAGE, 2.6)
    left, right = style.panels(drawing, 2)
    draw_return(left, record)
    draw_total_error(right, record)
    style.legend(right, "upper right")
    return drawing


def draw_return(axes: Axes, record: xr.Dataset) -> None:
    """Return of every episode."""
    returns = record["return"].transpose("replicate", "episode").values
    _draw(axes, record, returns, style.BLUE)
    style.label(axes, "Episode", style.quantity("Return", record["return"].attrs.get("units", "")))


def draw_total_error(axes: Axes, record: xr.Dataset) -> None:
    """Total error of every episode and, where the noise is known, its expectation 2 sigma^2."""
    errors = record["e_total"].isel(step=-1).transpose("replicate", "episode").values
    logarithmic = curves.spans_decades(errors)
    if logarithmic:
        axes.set_yscale("log")
        errors = np.where(errors > 0, errors, np.nan)
    _draw(axes, record, errors, style.VERMILLION)
    draw_expectation(axes, float(record.attrs.get("noise", 0.0)))
    name = "Total error $e_{\\mathrm{total}}$"
    style.label(axes, "Episode", style.quantity(name, record["e_total"].attrs.get("units", "")))


def draw_expectation(axes: Axes, noise: float) -> None:
    """What e_f + e_cv comes to if theta is known exactly: 2 sigma^2 (nothing without noise)."""
    if noise > 0:
        text = f"expected, $2\\sigma^2 = {2 * noise**2:.3g}$"
        axes.axhline(
            2 * noise**2, color=style.INK, linewidth=0.9, linestyle=(0, (4, 2)), label=text, zorder=4
        )


def window(episodes: int) -> int:
    """Length of the rolling mean: a tenth of the run, at most 50 episodes."""
    return max(1, min(_LONGEST, episodes // 10))


def _draw(axes: Axes, record: xr.Dataset, values: NDArray, colour: str) -> None:
    """A series for each replicate, ``values`` (replicates, episodes), on dressed axes."""
    episodes, length = numbers(record), window(values.shape[1])
    if values.shape[0] == 1:
        curves.draw_smoothed(axes, episodes, values[0], length, colour)
    else:
        name = f"median of {values.shape[0]} replicates" + (f", mean of {length}" if length > 1 else "")
        curves.draw_band(axes, episodes, curves.rolling_mean(values, length), colour, name)
    style.open_frame(axes)
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.margins(x=0.02)


def numbers(record: xr.Dataset) -> NDArray:
    """The number of every episode: its coordinate, else counted from 1."""
    return (
        record["episode"].values if "episode" in record.coords else np.arange(1, record.sizes["episode"] + 1)
    )
