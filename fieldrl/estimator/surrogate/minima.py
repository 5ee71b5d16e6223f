"""Minima of a fold's loss on the surrogate, and how far each of them may be trusted.

The fold's minimiser moves and its loss changes with every error e of the surrogate's predictions and every
error G of their slopes, which are jointly normal. To first order, and for the left-out sample with G_i,

    move of the minimiser            d = -H^-1 (J^T W e + G^T W r)
    loss of u above its minimum      d^T H d
    loss at u                        2 (W r)^T e + e^T W e
    residual of the left-out sample  e_i + (J_i + G_i) d

| symbol | meaning | shape | unit |
|---|---|---|---|
| u | scaled unknowns (theta - theta0) / s | (p,) | half-width of the bounds |
| r, J | residuals of the surrogate's mean, and their slope by u | (n,), (n, p) | field unit |
| W | weights of the samples in the fold, on a diagonal | (n,) | |
| H = J^T W J + tau I | half the curvature, over unknowns not at a bound | (p, p) | field unit^2 |
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.estimator.surrogate.improvement import descend
from fieldrl.estimator.surrogate.predictions import Surrogate, covary, linearise, predict

REACH = 0.2
"""So far a move to first order is believed; where nothing holds it, it is longer [half-width]."""

_SAME = 1e-3  # minima closer than this are one [half-width]
_DESCENT = 40  # evaluations of the surrogate in a descent


class Minimum(NamedTuple):
    """A minimum of a fold's loss on the surrogate's mean.

    Args:
        u: where, (p,) [half-width].
        loss: there [field unit^2].
        residuals: prediction - value of all samples there, (n,) [field unit].
        deviation: standard deviation of the loss at u [field unit^2].
        excess: expected loss of u above the true minimum nearby; of the lowest minimum alone [field unit^2].
        left_out: standard deviation of the left-out sample's residual, 0 for fold 0; of the lowest minimum
            alone [field unit].
        move: standard deviation of the true minimiser's place along the direction in which it is greatest,
            (p,); of the lowest minimum alone [half-width].
        reachable: expected excess within ``REACH`` of u, at most; of the lowest minimum alone [field unit^2].
    """

    u: NDArray[np.float64]
    loss: float
    residuals: NDArray[np.float64]
    deviation: float
    excess: float = np.nan
    left_out: float = np.nan
    move: NDArray[np.float64] | None = None
    reachable: float = np.nan


def minima(
    surrogate: Surrogate,
    values: NDArray[np.float64],
    weights: NDArray[np.float64],
    tikhonov: float,
    starts: NDArray[np.float64],
    fold: int,
) -> list[Minimum]:
    """The distinct minima that descents from ``starts`` (m, p) reach, the lowest first.

    Args:
        surrogate: of the predictions.
        values: the samples', (n,) [field unit].
        weights: of the samples in the fold, (n,).
        tikhonov: tau [field unit^2].
        starts: scaled unknowns, (m, p).
        fold: 0, or i + 1 where sample i is left out.
    """
    ends, losses = starts.copy(), np.empty(len(starts))
    _descend_all(surrogate, values, weights, tikhonov, ends, losses)
    places = _distinct(ends, np.argsort(losses, kind="stable"))
    mean, spread = predict(surrogate, ends[places])
    residuals = mean - values
    first, second = np.sum((weights * spread * residuals) ** 2, axis=1), np.sum(weights * spread**2, axis=1)
    deviations = 2.0 * np.sqrt(first) + second
    found = [
        Minimum(ends[place], float(losses[place]), *told)
        for place, *told in zip(places, residuals, deviations.tolist(), strict=True)
    ]
    doubts = _doubts(surrogate, found[0].residuals, weights, tikhonov, found[0].u, fold - 1)
    excess, left_out, moves, reachable = doubts
    variances, directions = np.linalg.eigh(moves)
    move = directions[:, -1] * np.sqrt(max(float(variances[-1]), 0.0))
    return [found[0]._replace(excess=excess, left_out=left_out, move=move, reachable=reachable), *found[1:]]


@njit(cache=True, error_model="numpy")
def apart(points, order, count, gap):
    """The first ``count`` of ``points`` (m, p) in ``order`` that lie farther than ``gap`` from each other."""
    chosen = np.empty(count, dtype=np.int64)
    found = 0
    for i in order:
        if found == count:
            break
        if _is_apart(points, i, chosen[:found], gap):
            chosen[found] = i
            found += 1
    return chosen[:found]


@njit(cache=True)
def _is_apart(points, i, chosen, gap):
    for j in chosen:
        farthest = 0.0
        for q in range(points.shape[1]):
            farthest = max(farthest, abs(points[i, q] - points[j, q]))
        if farthest <= gap:
            return False
    return True


def _distinct(ends: NDArray, order: NDArray) -> NDArray[np.int64]:
    return apart(ends, order, len(ends), _SAME)


@njit(cache=True, error_model="numpy")
def _descend_all(surrogate, values, weights, tikhonov, ends, losses):
    for i in range(len(ends)):
        losses[i] = descend(surrogate, values, weights, tikhonov, ends[i], _DESCENT)


@njit(cache=True, error_model="numpy")
def _doubts(surrogate, residuals, weights, tikhonov, u, left_out):
    """Excess, doubt of the left-out residual, covariance of the move, and reachable: see ``Minimum``."""
    n, p = residuals.size, u.size
    mean, slope, covariance = np.empty(n), np.empty((n, p)), np.empty((n, 1 + p, 1 + p))
    linearise(surrogate, u, mean, slope)
    covary(surrogate, u, covariance)
    inverse = _inverse_curvature(slope, residuals, weights, tikhonov, u)
    gradient = _doubt_of_gradient(slope, residuals, weights, covariance)
    excess, variance, moves = 0.0, 0.0, np.zeros((p, p))
    for a in range(p):
        for b in range(p):
            excess += inverse[a, b] * gradient[b, a]
            for c in range(p):
                for d in range(p):
                    moves[a, b] += inverse[a, c] * gradient[c, d] * inverse[d, b]
    reachable = 2.0 * REACH * np.sqrt(max(np.trace(gradient), 0.0))
    if left_out < 0:
        return max(excess, 0.0), 0.0, moves, reachable
    for a in range(p):
        for b in range(p):
            product = slope[left_out, a] * slope[left_out, b]
            variance += (product + covariance[left_out, 1 + a, 1 + b]) * moves[a, b]
    return max(excess, 0.0), np.sqrt(max(covariance[left_out, 0, 0] + variance, 0.0)), moves, reachable


@njit(cache=True, error_model="numpy")
def _inverse_curvature(slope, residuals, weights, tikhonov, u):
    """H^-1, (p, p); zero for an unknown held at its bound."""
    n, p = slope.shape
    gradient, curvature, held = tikhonov * u, (tikhonov + 1e-12) * np.eye(p), np.zeros(p, dtype=np.bool_)
    for j in range(n):
        for a in range(p):
            gradient[a] += weights[j] * slope[j, a] * residuals[j]
            for b in range(p):
                curvature[a, b] += weights[j] * slope[j, a] * slope[j, b]
    for a in range(p):
        if (u[a] >= 1.0 and gradient[a] < 0.0) or (u[a] <= -1.0 and gradient[a] > 0.0):
            held[a] = True
            curvature[a, :], curvature[:, a], curvature[a, a] = 0.0, 0.0, 1.0
    inverse = np.linalg.inv(curvature)
    for a in range(p):
        if held[a]:
            inverse[a, a] = 0.0
    return inverse


@njit(cache=True, error_model="numpy")
def _doubt_of_gradient(slope, residuals, weights, covariance):
    """Covariance of J^T W e + G^T W r, (p, p)."""
    n, p = slope.shape
    total = np.zeros((p, p))
    for j in range(n):
        c, r, square = covariance[j], residuals[j], weights[j] * weights[j]
        for a in range(p):
            for b in range(p):
                both = slope[j, a] * c[0, 1 + b] + slope[j, b] * c[0, 1 + a]
                total[a, b] += square * (
                    slope[j, a] * slope[j, b] * c[0, 0] + r * both + r * r * c[1 + a, 1 + b]
                )
    return total
