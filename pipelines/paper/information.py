"""What samples are worth, whatever was measured: the field without noise, and how well it tells theta.

| symbol | meaning | shape |
|---|---|---|
| J | derivatives of the field by the parameters, in half-widths of their bounds, per sigma | (..., n, p) |
| I | Fisher information of a path and of the bounds, J^T J + 1 | (..., p, p) |
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.estimator.problem import Differentiable
from fieldrl.mission import Mission
from pipelines.experiments import Found

_STEP = 1e-3  # of the differences, in half-widths of the bounds


def field_along(run: Found) -> NDArray[np.float64]:
    """The true field where each sample was taken, without noise, (r, episodes, steps) [field]."""
    positions, times = _places(run.record)
    truth: Any = run.mission.water.truth()
    values = truth.predict(run.record["true"].values[None], positions.reshape(-1, 2), times.ravel())
    return values.reshape(times.shape)


def bounds(run: Found) -> NDArray[np.float64]:
    """How well the samples of each path can tell the parameters, (replicates, episodes) [half-widths].

    The Cramer-Rao bound: root mean square over the parameters of the least standard deviation of an unbiased
    estimate. The bounds of the search count as knowledge with a standard deviation of one half-width, so that
    a path that tells nothing has the bound 1.
    """
    positions, times = _places(run.record)
    scaled = _derivatives(run.mission, positions.reshape(-1, 2), times.ravel())
    scaled = scaled.reshape(*times.shape, -1) / run.mission.vehicle.sensor.noise
    information = np.swapaxes(scaled, -1, -2) @ scaled + np.eye(scaled.shape[-1])
    return np.sqrt(np.diagonal(np.linalg.inv(information), axis1=-2, axis2=-1).mean(axis=-1))


def errors(record: xr.Dataset, mission: Mission) -> NDArray[np.float64]:
    """|estimate - true| after the last sample of every episode, as ``bounds``, (replicates, episodes)."""
    theta = record["theta"].isel(step=-1).transpose("replicate", "episode", "parameter").values
    scaled = (theta - record["true"].values) / mission.water.parameters.half_width
    return np.sqrt((scaled**2).mean(axis=-1))


def _derivatives(mission: Mission, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
    """Derivatives of the field at the true parameters, by half-widths, (n, p) [field unit]."""
    water, scale = mission.water, mission.water.parameters.half_width
    true = np.array(water.parameters.true)
    if isinstance(water, Differentiable):
        return water.jacobian(true[None], positions, times)[0] * scale
    shift = _STEP * np.diag(scale)
    up, down = (water.predict(true + sign * shift, positions, times) for sign in (1, -1))
    return (up - down).T / (2 * _STEP)


def _places(record: xr.Dataset) -> tuple[NDArray, NDArray]:
    """Where and when every sample was taken, (r, e, s, 2) and (r, e, s)."""
    positions = record["position"].transpose("replicate", "episode", "step", "axis").values
    return positions, record["time"].transpose("replicate", "episode", "step").values
