"""What every curve shares: rolling means, quartiles over replicates, and when a scale should be logarithmic.

Everything skips what is not finite, without a warning.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

_DECADES = 1.5  # a wider range of values needs a logarithmic scale


def rolling_mean(values: ArrayLike, window: int) -> NDArray[np.float64]:
    """Mean of each value and the ``window`` - 1 before it (of fewer at the beginning), along the last axis.

    Args:
        values: (..., n).
        window: >= 1.

    Returns:
        (..., n); NaN where the window holds no finite value.
    """
    values = np.asarray(values, dtype=float)
    finite = np.isfinite(values)
    total = _windowed_sum(np.where(finite, values, 0.0), window)
    count = _windowed_sum(finite.astype(float), window)
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)


def quartiles(values: ArrayLike) -> NDArray[np.float64]:
    """Lower quartile, median and upper quartile over the first axis of ``values`` (r, n), (3, n)."""
    values = np.asarray(values, dtype=float)
    result = np.full((3, values.shape[1]), np.nan)
    known = np.isfinite(values).any(axis=0)
    if known.any():
        columns = np.where(np.isfinite(values), values, np.nan)[:, known]
        result[:, known] = np.nanquantile(columns, [0.25, 0.5, 0.75], axis=0)
    return result


def spans_decades(values: ArrayLike) -> bool:
    """Whether the positive values spread so widely that only a logarithmic scale shows them."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values) & (values > 0)]
    return bool(values.size and np.log10(values.max() / values.min()) > _DECADES)


def draw_band(axes: Axes, x: NDArray, values: NDArray, colour: str, name: str) -> None:
    """Median (line) and interquartile range (band) over the first axis of ``values`` (r, n)."""
    low, median, high = quartiles(values)
    axes.fill_between(
        x, low, high, color=colour, alpha=0.25, linewidth=0, label="interquartile range", zorder=2
    )
    axes.plot(x, median, color=colour, linewidth=1.3, label=name, zorder=3, marker=_marker(x), markersize=3)


def draw_smoothed(axes: Axes, x: NDArray, values: NDArray, window: int, colour: str) -> None:
    """One series (n,): each value, thin, and its rolling mean."""
    if window == 1:
        axes.plot(x, values, color=colour, linewidth=1.1, marker=_marker(x), markersize=3, zorder=3)
        return
    axes.plot(x, values, color=colour, linewidth=0.5, alpha=0.4, label="each episode", zorder=2)
    axes.plot(
        x, rolling_mean(values, window), color=colour, linewidth=1.5, label=f"mean of {window}", zorder=3
    )


def _marker(x: NDArray) -> str:
    return "o" if x.size <= 30 else ""


def _windowed_sum(values: NDArray, window: int) -> NDArray:
    total = np.cumsum(values, axis=-1)
    before = np.zeros_like(total)
    before[..., window:] = total[..., :-window]
    return total - before
