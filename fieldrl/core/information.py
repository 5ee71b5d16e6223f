"""What samples tell of the unknowns, to first order: Fisher information and what follows from it.

| symbol | meaning | shape | unit |
|---|---|---|---|
| s | half-widths of the bounds | (p,) | each its own |
| S | sensitivities: derivatives of the predictions by theta / s, over the noise | (..., n, p) | 1 |
| F | I + S^T S; I stands for what the bounds themselves tell | (..., p, p) | 1 |
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.parameters import Parameters

_STEP = 1e-4  # of a difference, in half-widths of the bounds


class Model(Protocol):
    """What predicts the field; see ``fieldrl.estimator.problem.ForwardModel``."""

    @property
    def parameters(self) -> Parameters: ...

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]: ...


def sensitivities(
    model: Model, theta: NDArray, positions: NDArray, times: NDArray, noise: float
) -> NDArray[np.float64]:
    """S at one theta (p,), (n, p): ``slopes`` over the noise.

    Args:
        model: what predicts.
        theta: (p,).
        positions: (n, 2) [length].
        times: (n,) [time].
        noise: standard deviation of a sample's noise > 0 [field unit].
    """
    return slopes(model, theta, positions, times) / noise


def slopes(model: Model, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
    """Derivatives of the predictions by theta / s, (n, p): by the model's derivatives or, where it has none,
    by central differences [field unit]."""
    theta, half_width = np.asarray(theta, dtype=float), model.parameters.half_width
    if hasattr(model, "jacobian"):
        return model.jacobian(theta[None], positions, times)[0] * half_width  # type: ignore[attr-defined]
    low, high = np.asarray(model.parameters.lower), np.asarray(model.parameters.upper)
    step = np.diag(_STEP * half_width)
    ahead, behind = np.minimum(theta + step, high), np.maximum(theta - step, low)
    p = len(theta)
    rows = model.predict(np.concatenate([ahead, behind]), positions, times)
    return ((rows[:p] - rows[p:]) / (np.diag(ahead - behind) / half_width)[:, None]).T


def fisher(sensitivity: NDArray[np.float64]) -> NDArray[np.float64]:
    """F = I + S^T S, (..., p, p), of S (..., n, p)."""
    return np.eye(sensitivity.shape[-1]) + np.swapaxes(sensitivity, -1, -2) @ sensitivity


def uncertainty(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """Root of the mean variance of theta / s, sqrt(tr F^-1 / p): 1 knows the bounds alone, (...)."""
    variances = np.linalg.inv(information)
    return np.sqrt(np.trace(variances, axis1=-2, axis2=-1) / information.shape[-1])
