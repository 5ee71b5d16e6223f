"""Minima of a fold's loss on the surrogate, and how far each of them may be trusted.

Where the surrogate says that the predictions are y +- s, the fold's minimiser moves and its loss changes with
every error e ~ N(0, s^2) of the predictions. To first order, with e constant about the minimiser,

    move of the minimiser            d = -H^-1 J^T W e
    loss of u above its minimum      d^T H d
    loss at u                        2 (W r)^T e + e^T W e
    residual of the left-out sample  e_i + J_i d

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
from fieldrl.estimator.surrogate.predictions import Surrogate, linearise, predict

_SAME = 1e-3  # minima closer than this are one [half-width]
_DESCENT = 40  # evaluations of the surrogate in a descent


class Minimum(NamedTuple):
    """A minimum of a fold's loss on the surrogate's mean.

    Args:
        u: where, (p,) [half-width].
        loss: there [field unit^2].
        residuals: prediction - value of all samples there, (n,) [field unit].
        excess: expected loss of u above the true minimum nearby [field unit^2].
        deviation: standard deviation of the loss at u [field unit^2].
        left_out: standard deviation of the left-out sample's residual; 0 for fold 0 [field unit].
    """

    u: NDArray[np.float64]
    loss: float
    residuals: NDArray[np.float64]
    excess: float
    deviation: float
    left_out: float


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
    _, deviations = predict(surrogate, ends[places])
    found = []
    for place, deviation in zip(places, deviations, strict=True):
        residuals = np.empty(len(values))
        doubts = _doubts(surrogate, values, weights, tikhonov, ends[place], deviation, fold - 1, residuals)
        found.append(Minimum(ends[place], float(losses[place]), residuals, *doubts))
    return found


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
def _doubts(surrogate, values, weights, tikhonov, u, deviation, left_out, residuals):
    """Expected excess, deviation of the loss and of the left-out residual at u; residuals in place."""
    n, p = values.size, u.size
    slope = np.empty((n, p))
    linearise(surrogate, u, residuals, slope)
    residuals -= values
    gradient, curvature = tikhonov * u, tikhonov * np.eye(p)
    for j in range(n):
        for a in range(p):
            gradient[a] += weights[j] * slope[j, a] * residuals[j]
            for b in range(p):
                curvature[a, b] += weights[j] * slope[j, a] * slope[j, b]
    for a in range(p):
        if (u[a] >= 1.0 and gradient[a] < 0.0) or (u[a] <= -1.0 and gradient[a] > 0.0):
            slope[:, a] = 0.0
            curvature[a, :], curvature[:, a], curvature[a, a] = 0.0, 0.0, 1.0
    moves = np.linalg.solve(curvature + 1e-12 * np.eye(p), slope.T.copy())  # H^-1 J^T, (p, n)
    excess, first, second, along = 0.0, 0.0, 0.0, 0.0
    for j in range(n):
        error = (weights[j] * deviation[j]) ** 2
        first += error * residuals[j] ** 2
        second += weights[j] * deviation[j] ** 2
        for a in range(p):
            excess += error * slope[j, a] * moves[a, j]
        if left_out >= 0:
            shift = 0.0
            for a in range(p):
                shift += slope[left_out, a] * moves[a, j]
            along += error * shift * shift
    if left_out >= 0:
        along += deviation[left_out] ** 2
    return excess, 2.0 * np.sqrt(first) + second, np.sqrt(along)
