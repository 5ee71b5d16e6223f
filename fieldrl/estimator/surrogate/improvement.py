"""What the surrogate says of a loss: where it descends to, and whether a basin may hide that nobody has seen.

The loss of a fold is a known function of the predictions, so its distribution follows from theirs
(composite Bayesian optimisation, Astudillo & Frazier 2019).

| symbol | meaning | shape | unit |
|---|---|---|---|
| u | scaled unknowns | (p,) | half-width of the bounds |
| w | weights of the samples in a fold | (n,) | |
| tau | Tikhonov weight | | field unit^2 |
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.estimator.surrogate.predictions import Surrogate, linearise, predict

_SHRINK, _GROW, _LEAST, _LARGEST = 0.2, 5.0, 1e-9, 1e8  # Marquardt's damping
_RATES = 2.0 ** np.arange(14)  # where the bound is tried
_INDEPENDENT = 0.5  # the share of the outputs that vary independently, for the bound
_MOST = 5  # the cautious bound takes no more outputs for independent
_STILL = 1e-7  # a step that ends a descent [half-width]


def improvement_bound(
    surrogate: Surrogate, u: NDArray[np.float64], values: NDArray[np.float64], tikhonov: float, bar: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cautious upper bound of the expected gain of fold 0 below ``bar`` at u (m, p), and which u are likely.

    From t <= exp(rate t - 1) / rate for every rate > 0, a Chernoff bound; the expectation has a closed form.
    Unlike an average over draws it sees gains of very small probability, of which there are many. Outputs in
    fact move together (where the feature passes, or not), which the surrogate does not know: doubts about
    many of them count as doubts about half as many. That tells likely places from others; how large a gain
    may be is judged more cautiously, by five independent outputs at most, however many samples there are.

    Returns:
        The bound (m,) [field unit^2]; and the logarithm of its share of ``bar`` with half of the outputs
        independent, by which places are ranked, (m,).
    """
    mean, deviation = predict(surrogate, u)
    square, variance = (mean - values) ** 2, deviation**2
    penalty = tikhonov * np.sum(u * u, axis=1) / bar
    cautious = likely = _log_bound(square, variance, penalty, bar, _INDEPENDENT)
    if _INDEPENDENT * values.size > _MOST:
        cautious = _log_bound(square, variance, penalty, bar, _MOST / values.size)
    return bar * np.exp(np.minimum(cautious, 0.0)), likely


def _log_bound(
    square: NDArray, variance: NDArray, penalty: NDArray, bar: float, independent: float
) -> NDArray:
    n, exponents = square.shape[1], np.empty((_RATES.size, len(square)))
    for exponent, rate in zip(exponents, _RATES, strict=True):
        widened = 1.0 + (2.0 * rate / (n * bar)) * variance
        spread = np.sum(0.5 * independent * np.log(widened) + (rate / (n * bar)) * square / widened, axis=1)
        exponent[:] = rate - 1.0 - np.log(rate) - rate * penalty - spread
    return exponents.min(axis=0)


def basin_volume(surrogate: Surrogate, u: NDArray[np.float64], tikhonov: float, loss: float) -> float:
    """Volume about the minimiser u (p,) in which fold 0's loss stays below twice ``loss`` [half-width^p]."""
    n, p = surrogate.inverse_scales.shape
    mean, slope = np.empty(n), np.empty((n, p))
    linearise(surrogate, u, mean, slope)
    curvature = slope.T @ slope / n + tikhonov * np.eye(p)
    ball = math.pi ** (p / 2) / math.gamma(p / 2 + 1)
    return ball * loss ** (p / 2) / math.sqrt(max(float(np.linalg.det(curvature)), 1e-300))


@njit(cache=True, error_model="numpy")
def descend(surrogate, values, weights, tikhonov, u, iterations):
    """Levenberg-Marquardt on the surrogate's mean from u (p,), in place, within the box; returns the loss."""
    n, p = weights.size, u.size
    mean, slope, trial_mean, trial_slope = np.empty(n), np.empty((n, p)), np.empty(n), np.empty((n, p))
    matrix, gradient, trial, damping = np.empty((p, p)), np.empty(p), np.empty(p), 1e-3
    linearise(surrogate, u, mean, slope)
    loss = _loss(mean, values, weights, tikhonov, u)
    for _ in range(iterations):
        _normal_equations(mean, slope, values, weights, tikhonov, u, matrix, gradient)
        moved = _step(matrix, gradient, damping, u, trial)
        if moved < _STILL or damping > _LARGEST:
            break
        linearise(surrogate, trial, trial_mean, trial_slope)
        trial_loss = _loss(trial_mean, values, weights, tikhonov, trial)
        if trial_loss <= loss:
            settled = loss - trial_loss < 1e-9 * loss
            u[:], mean[:], slope[:], loss = trial, trial_mean, trial_slope, trial_loss
            damping = max(damping * _SHRINK, _LEAST)
            if settled:
                break
        else:
            damping *= _GROW
    return loss


@njit(cache=True, error_model="numpy")
def _loss(mean, values, weights, tikhonov, u):
    total = 0.0
    for q in range(u.size):
        total += tikhonov * u[q] * u[q]
    for j in range(mean.size):
        total += weights[j] * (mean[j] - values[j]) ** 2
    return total


@njit(cache=True, error_model="numpy")
def _normal_equations(mean, slope, values, weights, tikhonov, u, matrix, gradient):
    """Gauss-Newton matrix and gradient of half the loss; an unknown held at its bound is taken out."""
    p = u.size
    for a in range(p):
        gradient[a] = tikhonov * u[a]
        for b in range(p):
            matrix[a, b] = tikhonov + 1e-12 if a == b else 0.0
    for j in range(mean.size):
        for a in range(p):
            part = weights[j] * slope[j, a]
            gradient[a] += part * (mean[j] - values[j])
            for b in range(p):
                matrix[a, b] += part * slope[j, b]
    for a in range(p):
        if (u[a] >= 1.0 and gradient[a] < 0.0) or (u[a] <= -1.0 and gradient[a] > 0.0):
            matrix[a, :] = 0.0
            matrix[:, a] = 0.0
            matrix[a, a], gradient[a] = 1.0, 0.0


@njit(cache=True, error_model="numpy")
def _step(matrix, gradient, damping, u, trial):
    """The damped step by elimination (the matrix is positive), cut at the box; returns the largest move."""
    p = u.size
    work, right = matrix.copy(), -gradient
    for a in range(p):
        work[a, a] *= 1.0 + damping
    for a in range(p):
        for b in range(a + 1, p):
            share = work[b, a] / work[a, a]
            for c in range(a, p):
                work[b, c] -= share * work[a, c]
            right[b] -= share * right[a]
    moved = 0.0
    for a in range(p - 1, -1, -1):
        for b in range(a + 1, p):
            right[a] -= work[a, b] * right[b]
        right[a] /= work[a, a]
        trial[a] = min(1.0, max(-1.0, u[a] + right[a]))
        moved = max(moved, abs(trial[a] - u[a]))
    return moved
