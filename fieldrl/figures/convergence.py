"""Convergence of the fits: regret, the best loss so far over the least of the fit, against forward solves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from fieldrl.figures import curves, style

_MOST = 200  # single fits that are drawn
_NEGLIGIBLE = 1e-4  # of the noise's variance


def has_convergence(record: xr.Dataset) -> bool:
    """Whether the record holds traces of its fits (only some estimators leave them)."""
    return "trace_best" in record and bool(np.isfinite(record["trace_best"]).any())


def convergence_figure(record: xr.Dataset) -> Figure:
    """Regret of every fit against its solves.

    What is less than a ten-thousandth of the noise's variance is drawn there: it changes no estimate.

    Args:
        record: holds ``trace_best`` (..., solves), NaN beyond the end of a fit.
    """
    trace = record["trace_best"]
    drawing = style.figure(style.COLUMN, 2.6)
    (axes,) = style.panels(drawing, 1)
    found = regret(trace.values.reshape(-1, trace.shape[-1]))
    draw_convergence(axes, np.maximum(found, _floor(found, float(record.attrs.get("noise", 0.0)))))
    unit = trace.attrs.get("units", "")
    style.label(axes, "Forward solves of a fit", style.quantity("Regret", unit))
    style.legend_across(drawing, axes)
    return drawing


def regret(best: ArrayLike | Sequence[ArrayLike]) -> NDArray[np.float64]:
    """Best loss so far less the least of the fit, (fits, k); 0 after a fit has ended."""
    best = carried_on(padded(best))
    return best - best[:, -1:]


def draw_convergence(axes: Axes, best: ArrayLike | Sequence[ArrayLike]) -> None:
    """Each fit, thin, and over all fits the median and interquartile range.

    Args:
        axes: where to draw.
        best: for each fit its regret or least loss after 1, 2, ... solves, (fits, k), NaN-padded or of
            unequal lengths.
    """
    best = carried_on(padded(best))
    solves = np.arange(1, best.shape[1] + 1)
    chosen = best[np.unique(np.linspace(0, len(best) - 1, min(len(best), _MOST)).astype(int))]
    decades = curves.decades(best)
    if decades > curves.DECADES:
        style.logarithmic(axes, decades)
    axes.plot(solves, chosen.T, drawstyle="steps-post", color=style.GREY, linewidth=0.5, alpha=0.5, zorder=1)
    curves.draw_band(axes, solves, best, f"median of {len(best)} fits", steps=True)
    style.open_frame(axes)
    style.count_along_x(axes)


def padded(best: ArrayLike | Sequence[ArrayLike]) -> NDArray[np.float64]:
    """Rows of unequal lengths as one array, NaN beyond their ends; fits without any value are left out."""
    rows = [np.asarray(row, dtype=float).ravel() for row in best]  # pyright: ignore[reportGeneralTypeIssues, reportOptionalIterable]
    rows = [row for row in rows if np.isfinite(row).any()]
    result = np.full((len(rows), max((row.size for row in rows), default=0)), np.nan)
    for target, row in zip(result, rows, strict=True):
        target[: row.size] = row
    return result


def carried_on(best: NDArray[np.float64]) -> NDArray[np.float64]:
    """Running minimum of each row of ``best`` (fits, k): a fit that has ended keeps its best loss."""
    return np.fmin.accumulate(best, axis=1)


def _floor(found: NDArray[np.float64], noise: float) -> float:
    """The least regret that is drawn [field unit^2]."""
    if noise > 0:
        return _NEGLIGIBLE * noise**2
    return 1e-6 * float(np.nanmax(found, initial=0.0)) or 1.0
