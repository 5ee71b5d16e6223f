"""What every curve shares: rolling means, quartiles over replicates, and when a scale should be logarithmic.

Everything skips what is not finite, without a warning.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from fieldrl.figures import style

DECADES = 1.5  # a wider range of values needs a logarithmic scale


def rolling_mean(values: ArrayLike, window: int) -> NDArray[np.float64]:
    """Mean over the ``window`` values around each, along the last axis; at the ends, over a whole window too.

    (Fewer values there would let rare large errors count for less, and medians over replicates seem to fall.)

    Args:
        values: (..., n).
        window: odd, >= 1.

    Returns:
        (..., n); NaN where less than half of the window is finite.
    """
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    total = _windowed_sum(np.where(finite, values, 0.0), window)
    count = _windowed_sum(finite.astype(float), window)
    enough = 2 * count >= _windowed_sum(np.ones(values.shape), window)
    return np.where(enough, total / np.maximum(count, 1.0), np.nan)


def quartiles(values: ArrayLike) -> NDArray[np.float64]:
    """Lower quartile, median and upper quartile over the first axis of ``values`` (r, n), (3, n)."""
    values = np.asarray(values, dtype=float)
    result = np.full((3, values.shape[1]), np.nan)
    known = np.isfinite(values).any(axis=0)
    if known.any():
        columns = np.where(np.isfinite(values), values, np.nan)[:, known]
        result[:, known] = np.nanquantile(columns, [0.25, 0.5, 0.75], axis=0)
    return result


def decades(values: ArrayLike) -> float:
    """How many powers of ten lie between the least and the greatest positive value; 0 where there is none."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values) & (values > 0)]
    return float(np.log10(values.max() / values.min())) if values.size else 0.0


def episode_numbers(record: xr.Dataset) -> NDArray:
    """The number of every episode, (episodes,): its coordinate, else counted from 1."""
    counted = np.arange(1, record.sizes["episode"] + 1)
    return record["episode"].values if "episode" in record.coords else counted


def draw_band(axes: Axes, x: NDArray, values: NDArray, name: str, *, steps: bool = False) -> None:
    """Median (line) and interquartile range (band) over the first axis of ``values`` (r, n)."""
    low, median, high = quartiles(values)
    look = {"color": style.BLUE, "linewidth": 1.3, "marker": "" if steps else _marker(x), "markersize": 3}
    axes.plot(x, median, drawstyle="steps-post" if steps else "default", label=name, zorder=3, **look)
    band = {"color": style.BLUE, "alpha": 0.22, "linewidth": 0, "step": "post" if steps else None}
    axes.fill_between(x, low, high, label="interquartile range", zorder=2, **band)


def draw_compared(axes: Axes, x: NDArray, values: NDArray, name: str, number: int) -> NDArray[np.float64]:
    """As ``draw_band``, for series ``number`` of several; returns its quartiles, (3, n)."""
    low, median, high = quartiles(values)
    colour, dashes = style.SERIES[number], style.DASHES[number]
    axes.plot(x, median, label=name, color=colour, linestyle=dashes, linewidth=1.2, zorder=3 + number)
    axes.fill_between(x, low, high, color=colour, alpha=0.2, linewidth=0, zorder=2)
    return np.array([low, median, high])


def draw_smoothed(axes: Axes, x: NDArray, values: NDArray, window: int) -> None:
    """One series (n,): each value, thin, and its rolling mean."""
    if window == 1:
        axes.plot(x, values, color=style.BLUE, linewidth=1.1, marker=_marker(x), markersize=3, zorder=3)
        return
    axes.plot(x, values, color=style.BLUE, linewidth=0.5, alpha=0.4, label="each episode", zorder=2)
    mean = rolling_mean(values, window)
    axes.plot(x, mean, color=style.BLUE, linewidth=1.5, label=f"rolling mean of {window}", zorder=3)


def _marker(x: NDArray) -> str:
    return "o" if x.size <= 30 else ""


def _windowed_sum(values: NDArray, window: int) -> NDArray:
    """Sum over the whole window nearest to each value, along the last axis."""
    n = values.shape[-1]
    width = min(window, n)
    total = np.concatenate([np.zeros((*values.shape[:-1], 1)), np.cumsum(values, axis=-1)], axis=-1)
    first = np.clip(np.arange(n) - window // 2, 0, n - width)
    return total[..., first + width] - total[..., first]
