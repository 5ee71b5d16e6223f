"""The damped normal equations of one fold: assembled, solved by Cholesky, and read for uncertainty.

They are small (p, p) and solved thousands of times an episode, hence compiled loops and no LAPACK.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns | (p,) |
| r, J | residuals and their derivatives by theta | (n,), (n, p) |
| H, g | second and first derivatives of half the loss by u | (p, p), (p,) |
| C | the part of H with second derivatives of r, which Gauss-Newton leaves out | (p, p) |
| w | weights of the samples in the fold | (n,) |
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fieldrl.core.compiled import loop


@njit(cache=True, error_model="numpy")
def workspace(n, p):
    """Scratch arrays of ``minimise`` for n samples and p unknowns.

    Returns:
        The state of a descent: H (p, p), its part C that Gauss-Newton leaves out (p, p), g (p,) and the
        diagonal of H - C for the damping (p,); then scratch: vectors (3, p), Cholesky factor (p, p),
        residuals (n,), Jacobian (n, p) and which unknowns are free (p,).
    """
    state = np.empty((p, p)), np.zeros((p, p)), np.empty(p), np.empty(p)
    scratch = np.empty((3, p)), np.empty((p, p)), np.empty(n), np.empty((n, p)), np.empty(p, dtype=np.bool_)
    return state, scratch


@loop
def copy(source, target):
    """Copy a vector; a slice would first be copied aside."""
    for k in range(source.size):
        target[k] = source[k]


@loop
def _sum(residuals, jacobian, weights, matrix, gradient):
    """Weighted sums of J^T J (lower triangle) and J^T r over the samples."""
    gradient[:] = 0.0
    matrix[:] = 0.0
    for j in range(residuals.size):
        for k in range(gradient.size):
            slope = weights[j] * jacobian[j, k]
            gradient[k] += slope * residuals[j]
            for m in range(k + 1):
                matrix[k, m] += slope * jacobian[j, m]


@loop
def _sum_two(residuals, jacobian, weights, matrix, gradient):
    """``_sum`` for two unknowns, with the sums in registers."""
    a, b, c, d, e = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(residuals.size):
        x, y = jacobian[j, 0], jacobian[j, 1]
        wx, wy, r = weights[j] * x, weights[j] * y, residuals[j]
        a += wx * x
        b += wy * x
        c += wy * y
        d += wx * r
        e += wy * r
    matrix[0, 0], matrix[1, 0], matrix[1, 1], gradient[0], gradient[1] = a, b, c, d, e


@loop
def assemble(residuals, jacobian, weights, u, scale, tikhonov, state):
    """Lower triangle of H, g and the damping's diagonal at u, written into ``state``; C is added."""
    matrix, curvature, gradient, metric = state
    p = u.size
    if p == 2:
        _sum_two(residuals, jacobian, weights, matrix, gradient)
    else:
        _sum(residuals, jacobian, weights, matrix, gradient)
    for k in range(p):
        gradient[k] = gradient[k] * scale[k] + tikhonov * u[k]
        for m in range(k + 1):
            matrix[k, m] = matrix[k, m] * scale[k] * scale[m] + curvature[k, m]
        matrix[k, k] += tikhonov
        metric[k] = matrix[k, k] - curvature[k, k]


@loop
def _factorise(matrix, metric, free, damping, factor):
    """Cholesky factor of the damped system over the free unknowns; False where it is not positive."""
    for k in range(metric.size):
        for m in range(k + 1):
            total = matrix[k, m] if free[k] and free[m] else 0.0
            if k == m:
                total = total + damping * metric[k] if free[k] else 1.0
            for i in range(m):
                total -= factor[k, i] * factor[m, i]
            if k == m:
                if total <= 0.0:
                    return False
                factor[k, k] = math.sqrt(total)
            else:
                factor[k, m] = total / factor[m, m]
    return True


@loop
def _substitute(factor, step):
    """Solve with a Cholesky factor; the right side comes in ``step`` (p,), the solution replaces it."""
    for k in range(step.size):
        for i in range(k):
            step[k] -= factor[k, i] * step[i]
        step[k] /= factor[k, k]
    for k in range(step.size - 1, -1, -1):
        for i in range(k + 1, step.size):
            step[k] -= factor[i, k] * step[i]
        step[k] /= factor[k, k]


@loop
def damped_step(state, free, damping, factor, step):
    """The damped step of the free unknowns, 0 for the others; False where H is not positive."""
    matrix, _, gradient, metric = state
    if not _factorise(matrix, metric, free, damping, factor):
        return False
    for k in range(step.size):
        step[k] = -gradient[k] if free[k] else 0.0
    _substitute(factor, step)
    return True


@loop
def spread(loss, n, work, weakest):
    """Largest standard deviation of a scaled unknown where the last descent ended, n samples having the
    loss for variance; the direction of least certainty, of any length, goes into ``weakest`` (p,)."""
    (matrix, _, _, metric), (vectors, factor, _, _, free) = work
    column, largest = vectors[2], 0.0
    free[:] = True
    if not _factorise(matrix, metric, free, 0.0, factor):
        weakest[:] = 1.0
        return np.inf
    for k in range(column.size):
        column[:], column[k] = 0.0, 1.0
        _substitute(factor, column)
        if column[k] > largest:
            largest = column[k]
            copy(column, weakest)
    return math.sqrt(loss / max(n, 1) * largest)
