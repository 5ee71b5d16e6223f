"""A fold that leaves one sample out, from the minima of the full fit: a small change of it, compiled.

At a minimum of the full fit everything is known for all samples; without sample i the loss and its
derivatives follow by taking that sample's terms away, at the cost of (p, p) and not of the samples. The
derivatives at a minimum are found when the first fold starts there.

| symbol | meaning | shape |
|---|---|---|
| K | minima of the full fit | |
| A, b, q | sums over all samples of J^T J, r J and r^2, by scaled unknowns | (K, p, p), (K, p), (K,) |
| C, S | second derivatives S of r by scaled unknowns, and the sums of r S | (K, p, p), (K, n, p, p) |
| started | whether a fold has started at the minimum: whether A, b, C and S are there | (K,) |
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fieldrl.core.compiled import loop
from fieldrl.estimator.descent.levenberg_marquardt import copy_point, descend, minimise, shifted
from fieldrl.estimator.descent.normal_equations import copy, spread

_PROMISING = 4.0  # a known minimum is a start when its loss is below this times the best
_NEAR, FAR = 1e-6, 1e-3  # first damping from a known minimum, from a grid point
_DETERMINED = 0.25  # a minimum known to this part of a grid cell has no twin closer than the grid sees


@njit(cache=True, error_model="numpy")
def expand(minima, count):
    """Room for A, b, C and S at the first ``count`` minima, q, and that no fold has started there."""
    n, p = minima[1].shape[1], minima[0].shape[1]
    sums = np.zeros((count, p, p)), np.zeros((count, p)), np.zeros(count), np.zeros((count, p, p))
    expansion = *sums, np.empty((count, n, p, p)), np.zeros(count, dtype=np.bool_)
    for i in range(count):
        for j in range(n):
            expansion[2][i] += minima[1][i, j] ** 2
    return expansion


@loop
def _expand(model, samples, minima, i, work, expansion):
    """The derivatives at one minimum, in place."""
    places, residuals, jacobians = minima
    a, b, _, c, s, started = expansion
    _, (vectors, _, spare_residuals, spare, _) = work
    scale = model[3]
    for k in range(scale.size):
        shift = shifted(model, samples, places[i], k, vectors, spare_residuals, spare)
        for j in range(residuals.shape[1]):
            r, slope = residuals[i, j], jacobians[i, j, k] * scale[k]
            b[i, k] += r * slope
            for m in range(scale.size):
                s[i, j, k, m] = (spare[j, m] - jacobians[i, j, m]) * scale[m] / shift
                a[i, k, m] += slope * jacobians[i, j, m] * scale[m]
                c[i, k, m] += r * s[i, j, k, m]
    started[i] = True


@njit(cache=True, error_model="numpy")
def fold_scratch(n, p):
    """Scratch of ``fold_fit``: u (p,), residuals (n,), Jacobian (n, p), two directions (p,) and (2, p)."""
    return np.empty(p), np.empty(n), np.empty((n, p)), np.empty(p), np.empty((2, p))


@loop
def _loss_without(minima, expansion, i, out, weight, tikhonov):
    """The loss at minimum i of the fold that leaves sample ``out`` out."""
    u, total = minima[0], weight * max(expansion[2][i] - minima[1][i, out] ** 2, 0.0)
    for k in range(u.shape[1]):
        total += tikhonov * u[i, k] * u[i, k]
    return total


@loop
def _state_without(minima, expansion, i, out, weight, tikhonov, scale, state):
    """H, C, g and the damping's diagonal there, written into the state of a descent."""
    places, residuals, jacobians = minima
    a, b, _, c, s, _ = expansion
    matrix, curvature, gradient, metric = state
    r = residuals[i, out]
    for k in range(metric.size):
        slope = jacobians[i, out, k] * scale[k]
        gradient[k] = weight * (b[i, k] - r * slope) + tikhonov * places[i, k]
        for m in range(k + 1):
            curvature[k, m] = weight * (c[i, k, m] - r * s[i, out, k, m])
            matrix[k, m] = weight * (a[i, k, m] - slope * jacobians[i, out, m] * scale[m]) + curvature[k, m]
        matrix[k, k] += tikhonov
        metric[k] = matrix[k, k] - curvature[k, k]


@loop
def fold_fit(
    model, samples, weights, tikhonov, out, minima, expansion, grid, own, cell, stop, work, scratch, fit
):
    """The fold without sample ``out``: from the full fit's minima, from its own grid minima, and beside the
    best of these where it is poorly determined.

    Args:
        model: kernel address, constants, theta0 (p,), s (p,).
        samples: positions (n, 2), times (n,), values (n,).
        weights: of the samples in this fold, (n,).
        tikhonov: tau.
        out: the sample that is left out.
        minima: of the full fit, u (K, p), residuals (K, n), Jacobians (K, n, p), the best one first.
        expansion: from ``expand``; derivatives are added where the fold is the first to start.
        grid: scaled unknowns of the coarse grid, (G, p).
        own: places of the grid to start from as well.
        cell: the grid's spacing.
        stop: at most so many evaluations a descent; the scaled step that is the last.
        work: from ``workspace``.
        scratch: from ``fold_scratch``.
        fit: minimiser (p,), residuals there (n,) and gap (1,), written in place.

    Returns:
        The loss and the evaluations used.
    """
    u, residuals, jacobian, weakest, beside = scratch
    n, known = residuals.size, len(expansion[2])
    weight = weights[0] if out else weights[n - 1]
    least, evaluations, width, bar = np.inf, 0, 0.0, np.inf
    for i in range(known):
        bar = min(bar, _PROMISING * _loss_without(minima, expansion, i, out, weight, tikhonov))
    for start in range(known + len(own) + 2):
        if start < known:
            loss = _loss_without(minima, expansion, start, out, weight, tikhonov)
            if loss > bar:
                continue
            if not expansion[5][start]:
                _expand(model, samples, minima, start, work, expansion)
            copy_point(minima[0][start], minima[1][start], minima[2][start], u, residuals, jacobian)
            _state_without(minima, expansion, start, out, weight, tikhonov, model[3], work[0])
            loss, used, gap = descend(
                model, samples, weights, tikhonov, u, residuals, jacobian, loss, _NEAR, least, stop, work
            )
        elif _next_start(start - known, grid, own, cell, width, fit[0], weakest, beside, u):
            loss, used, gap = minimise(
                model, samples, weights, tikhonov, u, residuals, jacobian, FAR, least, stop, work
            )
        else:
            break
        evaluations += used
        if loss < least:
            least, width = loss, spread(loss, n - 1, work, weakest)
            copy(u, fit[0])
            copy(residuals, fit[1])
            fit[2][0] = gap
    return least, evaluations


@loop
def _next_start(number, grid, own, cell, width, best, weakest, beside, u):
    """Write into u (p,) where descent ``number`` from no known minimum starts; False where none is needed."""
    if number < len(own):
        copy(grid[own[number]], u)
        return True
    if width < _DETERMINED * cell:
        return False
    if number == len(own):
        shift(best, weakest, cell, beside)
    copy(beside[number - len(own)], u)
    return True


@loop
def shift(u, weakest, cell, beside):
    """Points one grid cell either way from u along its least determined direction, in the box, (2, p)."""
    longest = 0.0
    for k in range(u.size):
        longest = max(longest, abs(weakest[k]))
    for k in range(u.size):
        move = cell * weakest[k] / longest
        beside[0, k] = min(1.0, max(-1.0, u[k] - move))
        beside[1, k] = min(1.0, max(-1.0, u[k] + move))
