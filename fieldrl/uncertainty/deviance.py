"""The deviance of all samples as a function of the scaled unknowns, and its minima.

D(u) = sum of ((prediction - value) / std)^2, minus twice the log likelihood up to a constant. The Tikhonov
term of the fit is left out: intervals say what the samples tell.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns (theta - theta0) / s; the bounds are |u| <= 1 | (m, p) |
| z | standardised residuals | (m, n) |
| J | their derivatives by u | (m, n, p) |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldrl.uncertainty.predictions import Predictions

_FIRST, _LEAST, _LARGEST = 1e-3, 1e-9, 1e9  # Marquardt's damping
_SHRINK, _GROW = 0.2, 6.0
_SETTLED = 1e-6  # a descent ends when it would gain less
_ROUNDING = 1e-12  # of the deviance, relative


@dataclass(frozen=True)
class Deviance:
    """D(u) of n samples.

    Args:
        predictions: of the samples.
        values: the samples', (n,) [field unit].
        std: of their noise, (n,) [field unit].
        censored: which values are a limit that the field was at or below, (n,); None: none is.
    """

    predictions: Predictions
    values: NDArray[np.float64]
    std: NDArray[np.float64]
    censored: NDArray[np.bool_] | None = None

    def linearise(self, u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """z (m, n) and J (m, n, p) at u (m, p)."""
        y, slopes = self.predictions.linearise(u)
        z, slopes = (y - self.values) / self.std, slopes / self.std[:, None]
        if self.censored is not None:
            below = self.censored & (z < 0.0)
            z[below], slopes[below] = 0.0, 0.0
        return z, slopes

    def at(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """D at u (m, p), (m,)."""
        return np.sum(self.linearise(u)[0] ** 2, axis=1)

    def doubt(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Standard deviation of D at u (m, p) by the doubt of the predictions, (m,)."""
        z, spread = self.linearise(u)[0], self.predictions.doubt(u) / self.std
        return np.sqrt(np.sum((2.0 * z * spread) ** 2 + 2.0 * spread**4, axis=1))


def descend(
    deviance: Deviance, u: NDArray[np.float64], held: NDArray[np.bool_], iterations: int = 60
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Levenberg-Marquardt from many starts at once, within the box |u| <= 1.

    Args:
        deviance: what is minimised.
        u: starts, (m, p).
        held: which unknowns of each start stay as they are, (m, p).
        iterations: at most so many steps.

    Returns:
        Where they end, (m, p), and D there, (m,).
    """
    u = np.clip(u, -1.0, 1.0)
    z, slopes = deviance.linearise(u)
    loss, damping, going = np.sum(z**2, axis=1), np.full(len(u), _FIRST), np.arange(len(u))
    gradient, curvature = _normal_equations(z, slopes)
    for _ in range(iterations):
        trial, promised = _step(u[going], gradient[going], curvature[going], held[going], damping[going])
        going_on = promised > _SETTLED + _ROUNDING * loss[going]
        going, trial = going[going_on], trial[going_on]
        if not going.size:
            break
        z, slopes = deviance.linearise(trial)
        new = np.sum(z**2, axis=1)
        better = new <= loss[going]
        won = going[better]
        u[won], loss[won] = trial[better], new[better]
        gradient[won], curvature[won] = _normal_equations(z[better], slopes[better])
        damping[won] = np.maximum(damping[won] * _SHRINK, _LEAST)
        damping[going[~better]] *= _GROW
        going = going[damping[going] < _LARGEST]
    return u, loss


def minima(
    deviance: Deviance, starts: NDArray[np.float64], apart: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The distinct minima that descents from ``starts`` (m, p) reach, the lowest first.

    Args:
        deviance: what is minimised.
        starts: where from.
        apart: nearer to a lower one than this, in every unknown, is the same.

    Returns:
        (k, p), and D there, (k,).
    """
    ends, losses = descend(deviance, starts, np.zeros(starts.shape, dtype=bool))
    chosen: list[int] = []
    for i in np.argsort(losses, kind="stable"):
        if all(np.max(np.abs(ends[i] - ends[j])) > apart for j in chosen):
            chosen.append(int(i))
    return ends[chosen], losses[chosen]


def _normal_equations(z: NDArray, slopes: NDArray) -> tuple[NDArray, NDArray]:
    """J^T z (m, p) and J^T J (m, p, p)."""
    across = slopes.transpose(0, 2, 1)
    return (across @ z[:, :, None])[:, :, 0], across @ slopes


def _step(
    u: NDArray, gradient: NDArray, curvature: NDArray, held: NDArray, damping: NDArray
) -> tuple[NDArray, NDArray]:
    """Damped steps within the box, (m, p), and what the quadratic model promises of them, (m,)."""
    fixed = held | ((u >= 1.0) & (gradient < 0.0)) | ((u <= -1.0) & (gradient > 0.0))
    matrix = np.where(fixed[:, :, None] | fixed[:, None, :], 0.0, curvature)
    diagonal = np.einsum("mkk->mk", matrix)  # a view
    floor = 1e-10 * diagonal.max(axis=1, keepdims=True) + 1e-12
    diagonal += np.where(fixed, 1.0, damping[:, None] * diagonal + floor)
    right = np.where(fixed, 0.0, -gradient)
    step = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    return np.clip(u + step, -1.0, 1.0), np.sum(right * step, axis=1)
