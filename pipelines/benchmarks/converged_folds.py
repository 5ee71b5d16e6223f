"""Converged fits of every fold, to judge estimators by: all minima of a Chebyshev interpolant of the model.

Predictions are analytic in the unknowns, so their interpolant at M x N Chebyshev nodes converges fast; one
solve at a node serves all problems. A fold's minima are those of a fine grid of the interpolant, each
polished by Levenberg-Marquardt; every fold also starts from every other fold's minimum. What is solved is
kept in outputs/converged_folds/ and not computed again.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns, within [-1, 1] | (m, 2) |
| c | Chebyshev coefficients of the predictions | (M, N, n) |
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from joblib import Memory
from numpy.polynomial.chebyshev import chebder, chebvander
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl.cli.compose import composed
from fieldrl.runs.components import mission
from pipelines import report

_SIDE, _STARTS, _ITERATIONS = 161, 10, 60  # of the grid of the interpolant; descents of a fold; their steps

_MEMORY: Any = Memory(report.OUTPUTS / "converged_folds", verbose=0)
_WATERS: dict[tuple[str, ...], Any] = {}


def water(overrides: Sequence[str]) -> Any:
    """One model in a process, so that its solves are kept."""
    key = tuple(overrides)
    if key not in _WATERS:
        _WATERS[key] = mission(composed(["experiment=double_gyre", *overrides])).water
    return _WATERS[key]


def predict(overrides: Sequence[str], u: NDArray, positions: NDArray, times: NDArray) -> NDArray:
    """Predictions at scaled unknowns u (2,), by a process's own model that keeps no solve: (n,)."""
    with threadpool_limits(1):
        model = water((*overrides, "pde.solutions.memory=1"))
        theta = model.parameters.centre + model.parameters.half_width * u
        return model.predict(theta[None], positions, times)[0]


@_MEMORY.cache
def solves(overrides: Sequence[str], u: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
    """Predictions at several u (m, 2): (m, n); kept on disk."""
    return np.array([predict(overrides, one, positions, times) for one in u])


def nodes(count: int) -> NDArray[np.float64]:
    """Chebyshev nodes of [-1, 1], (count,)."""
    return np.cos(np.pi * (np.arange(count) + 0.5) / count)


def coefficients(values: NDArray) -> NDArray[np.float64]:
    """Chebyshev coefficients of values at all pairs of ``nodes``, (M, N, n) -> (M, N, n)."""
    first, second = (_cosines(count) for count in values.shape[:2])
    return np.einsum("ia,jb,abq->ijq", first, second, values, optimize=True)


def _cosines(count: int) -> NDArray[np.float64]:
    """Values at the nodes to coefficients, (count, count)."""
    order = np.arange(count)
    cosines = np.cos(order[:, None] * np.pi * (order + 0.5) / count) * 2 / count
    cosines[0] /= 2
    return cosines


class Interpolant:
    """Predictions of n samples as polynomials of the scaled unknowns; c from ``coefficients``."""

    def __init__(self, c: NDArray[np.float64]) -> None:
        self.c, self.slopes = c, (chebder(c, axis=0), chebder(c, axis=1))

    def predict(self, u: NDArray) -> NDArray[np.float64]:
        """(m, n)."""
        return _evaluate(self.c, u)

    def jacobian(self, u: NDArray) -> NDArray[np.float64]:
        """(m, n, 2)."""
        return np.stack([_evaluate(slope, u) for slope in self.slopes], axis=-1)

    def on_grid(self, x: NDArray) -> NDArray[np.float64]:
        """At all pairs of x (g,): (g, g, n)."""
        first, second = (chebvander(x, size - 1) for size in self.c.shape[:2])
        return np.einsum("ai,ijq,bj->abq", first, self.c, second, optimize=True)


def _evaluate(c: NDArray, u: NDArray) -> NDArray[np.float64]:
    first, second = (chebvander(x, size - 1) for x, size in zip(u.T, c.shape, strict=False))
    return np.einsum("mi,ijq,mj->mq", first, c, second, optimize=True)


class Folds(NamedTuple):
    """Minimisers of all n + 1 folds, their losses [field unit^2] and residuals (n + 1, n) [field unit]."""

    u: NDArray[np.float64]
    loss: NDArray[np.float64]
    residuals: NDArray[np.float64]

    @property
    def e_cv(self) -> float:
        """Eq. (6)."""
        return float(np.mean(np.diagonal(self.residuals[1:]) ** 2))


def converge(
    model: Interpolant, values: NDArray[np.float64], weights: NDArray[np.float64], tikhonov: float
) -> Folds:
    """The global minimum of every fold.

    Args:
        model: of the predictions.
        values: the samples', (n,) [field unit].
        weights: of the samples in each fold, (n + 1, n).
        tikhonov: tau [field unit^2].
    """
    folds = len(weights)
    starts = _grid_minima(model, values, weights, tikhonov)
    own = np.concatenate([np.full(len(start), fold) for fold, start in enumerate(starts)])
    u, loss, _ = _descend(model, values, weights[own], tikhonov, np.concatenate(starts))
    best = np.array([u[own == fold][np.argmin(loss[own == fold])] for fold in range(folds)])
    everywhere, fold_of = np.tile(best, (folds, 1)), np.repeat(np.arange(folds), folds)
    u, loss, residuals = _descend(model, values, weights[fold_of], tikhonov, everywhere)
    least = [int(np.argmin(np.where(fold_of == fold, loss, np.inf))) for fold in range(folds)]
    return Folds(u[least], loss[least], residuals[least])


def _grid_minima(model: Interpolant, values: NDArray, weights: NDArray, tikhonov: float) -> list[NDArray]:
    """The lowest local minima of each fold's loss on the grid."""
    x = np.linspace(-1, 1, _SIDE)
    squares = (model.on_grid(x) - values) ** 2
    penalty = tikhonov * (x[:, None] ** 2 + x[None] ** 2)
    found = []
    for row in weights:
        loss = np.pad(squares @ row + penalty, 1, constant_values=np.inf)
        inner = loss[1:-1, 1:-1]
        sides = [loss[a : a + _SIDE, b : b + _SIDE] for a in range(3) for b in range(3)]
        places = np.argwhere(inner <= np.min(sides, axis=0))
        order = np.argsort(inner[tuple(places.T)])[:_STARTS]
        found.append(x[places[order]])
    return found


def _descend(
    model: Interpolant, values: NDArray, weights: NDArray, tikhonov: float, u: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Levenberg-Marquardt within the square from every u (m, 2): u, losses, residuals."""
    u, damping, active = u.copy(), np.full(len(u), 1e-3), np.arange(len(u))
    residuals = model.predict(u) - values
    loss = np.sum(weights * residuals**2, axis=1) + tikhonov * np.sum(u**2, axis=1)
    for _ in range(_ITERATIONS):
        at, kept = u[active], weights[active]
        step = _step(model.jacobian(at), residuals[active], kept, tikhonov, at, damping[active])
        trial = np.clip(at + step, -1, 1)
        there = model.predict(trial) - values
        reached = np.sum(kept * there**2, axis=1) + tikhonov * np.sum(trial**2, axis=1)
        moved, better = np.abs(trial - at).max(axis=1), reached <= loss[active]
        place = active[better]
        u[place], residuals[place], loss[place] = trial[better], there[better], reached[better]
        damping[active] = np.where(better, np.maximum(damping[active] * 0.2, 1e-12), damping[active] * 5)
        active = active[moved >= 1e-9]
        if not active.size:
            break
    return u, loss, residuals


def _step(
    jacobian: NDArray, residuals: NDArray, weights: NDArray, tikhonov: float, u: NDArray, damping: NDArray
) -> NDArray[np.float64]:
    """Damped Gauss-Newton steps; unknowns held at a bound by their gradient stay, (m, 2)."""
    gradient = np.einsum("mn,mn,mnp->mp", weights, residuals, jacobian) + tikhonov * u
    matrix = np.einsum("mn,mnp,mnq->mpq", weights, jacobian, jacobian) + tikhonov * np.eye(2)
    held = ((u >= 1) & (gradient < 0)) | ((u <= -1) & (gradient > 0))
    for k in range(2):
        at = held[:, k]
        matrix[at, k, :], matrix[at, :, k], matrix[at, k, k], gradient[at, k] = 0.0, 0.0, 1.0, 0.0
    matrix[:, [0, 1], [0, 1]] *= 1 + damping[:, None]
    return -np.linalg.solve(matrix, gradient[..., None])[..., 0]
