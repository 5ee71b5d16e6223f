"""What the figures of the second experiment share: its run, the line between the gyres, fields in between."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from fieldrl.core.domain import Grid
from fieldrl.figures import style
from pipelines import experiments
from pipelines.experiments import Found, Settings, Wanted

RUN = "double_gyre"
PLAN = {RUN: Wanted("double_gyre")}


def separation(theta: ArrayLike, times: ArrayLike, length: float) -> NDArray[np.float64]:
    """Where the line between the gyres stands, the root of s X^2 + (1 - 2 s) X = 1 of Eq. (28).

    Args:
        theta: mu, omega.
        times: any shape [time].
        length: L, size of one gyre [length].

    Returns:
        x of the line at the times, of their shape [length].
    """
    mu, omega = np.asarray(theta, dtype=float)
    s = mu * np.sin(omega * np.asarray(times, dtype=float))
    # the root (sqrt(1 + 4 s^2) - (1 - 2 s)) / (2 s), written so that s = 0 is no exception
    return length * 2.0 / (1.0 - 2.0 * s + np.sqrt(1.0 + 4.0 * s**2))


def line_of(run: Found, times: ArrayLike) -> NDArray[np.float64]:
    """The separation line of a run's true flow at some times [length]."""
    flow = run.mission.water.flow
    return separation(run.record["true"].values, times, flow.length)  # type: ignore[attr-defined]


def draw_separation(axes: Axes, run: Found) -> None:
    """The line at the final time, and the band in which it swings during an episode."""
    times = np.linspace(0.0, float(run.record["time"].max()), 101)
    line = line_of(run, times)
    axes.axvspan(line.min(), line.max(), facecolor=style.GREY, alpha=0.18, linewidth=0, zorder=1)
    look = {"color": style.INK, "linewidth": 0.9, "linestyle": (0, (4, 2)), "zorder": 3}
    axes.axvline(line[-1], label="separation line", **look)


def fields(
    settings: Settings,
    run: Found,
    name: str,
    thetas: Sequence[NDArray],
    times: NDArray,
    truth: bool,
    cells: int,
) -> xr.DataArray:
    """The field at times between those of the record, solved once and kept.

    Args:
        settings: where they are kept.
        run: whose model solves.
        name: of the file that keeps them.
        thetas: parameters for each time, (k, p).
        times: (k,) [time].
        truth: by the model of the true field, or by the one that is fitted.
        cells: along x; along y half as many.

    Returns:
        (time, x, y) [field unit].
    """

    def compute() -> xr.Dataset:
        water = run.mission.water
        model, grid = (water.truth() if truth else water), water.domain.grid(cells, cells // 2)
        found = [model.field(theta, float(time), grid) for theta, time in zip(thetas, times, strict=True)]
        return _dataset(np.array(found), times, grid)

    parts = [run.key, np.asarray(thetas).tolist(), times.tolist(), truth, cells]
    return experiments.kept(settings, name, parts, compute)["field"]


def _dataset(values: NDArray, times: NDArray, grid: Grid) -> xr.Dataset:
    coordinates = {"time": times, "x": grid.x, "y": grid.y}
    return xr.Dataset({"field": (("time", "x", "y"), values, {"units": "field unit"})}, coordinates)
