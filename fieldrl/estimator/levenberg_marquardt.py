"""Levenberg-Marquardt for the folds of a fit problem, compiled; the model is called by address.

Works in scaled unknowns u = (theta - theta0) / s, so the bounds are the box |u| <= 1, kept by
projection: an unknown at its bound whose gradient points outwards stays there (an active set).
Gauss-Newton is slow in curved valleys and where residuals stay large; a descent that takes long goes
on with the true second derivatives, by differences of the exact gradient.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns | (p,) |
| r, J | residuals and their derivatives by theta | (n,), (n, p) |
| H, g | Gauss-Newton matrix and gradient of half the loss by u | (p, p), (p,) |
| w | weights of the samples in the fold | (n,) |
| damping | Marquardt's lambda | |
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fieldrl.core.compiled import call_model

_SHRINK, _GROW = 0.2, 4.0  # of the damping after success and failure
_LEAST, _FIRST, _LARGEST = 1e-12, 1e-5, 1e14  # damping: least, after a first failure, largest
_PATIENCE = 12  # evaluations after which Gauss-Newton is slow and Newton's matrix pays
_NEWTON = 5.0  # with second derivatives the last step may be so many times longer
_DIFFERENCE = 1e-6  # shift of a scaled unknown for second derivatives
_HOPE = 10.0  # a descent may gain so many times what its quadratic model promises


@njit(cache=True, error_model="numpy")
def linearise(kernel, constants, theta, positions, times, values, residuals, jacobian):
    """Residuals (n,) and their Jacobian (n, p) at theta (p,), written in place."""
    n = times.size
    call_model(
        kernel,
        theta.ctypes,
        1,
        positions.ctypes,
        times.ctypes,
        n,
        constants.ctypes,
        residuals.ctypes,
        jacobian.ctypes,
    )
    for j in range(n):
        residuals[j] -= values[j]


@njit(cache=True, error_model="numpy")
def loss_of(residuals, weights, u, tikhonov):
    """The penalised loss of a fold."""
    total = 0.0
    for j in range(residuals.size):
        total += weights[j] * residuals[j] * residuals[j]
    for k in range(u.size):
        total += tikhonov * u[k] * u[k]
    return total


@njit(cache=True, error_model="numpy")
def _normal_equations(residuals, jacobian, weights, u, scale, tikhonov, matrix, gradient, metric):
    """Lower triangle of H, its diagonal for the damping, and g at u, written in place."""
    p = u.size
    gradient[:] = 0.0
    matrix[:] = 0.0
    for j in range(residuals.size):
        weight = weights[j]
        for k in range(p):
            slope = weight * jacobian[j, k]
            gradient[k] += slope * residuals[j]
            for m in range(k + 1):
                matrix[k, m] += slope * jacobian[j, m]
    for k in range(p):
        gradient[k] = gradient[k] * scale[k] + tikhonov * u[k]
        for m in range(k + 1):
            matrix[k, m] *= scale[k] * scale[m]
        matrix[k, k] += tikhonov
        metric[k] = matrix[k, k]


@njit(cache=True, error_model="numpy")
def _solve(matrix, metric, gradient, free, damping, factor, step):
    """Step of the damped system over the free unknowns, by Cholesky; False where it is not positive."""
    p = gradient.size
    for k in range(p):
        for m in range(k + 1):
            total = matrix[k, m]
            if not (free[k] and free[m]):
                total = 0.0
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
    for k in range(p):
        total = -gradient[k] if free[k] else 0.0
        for i in range(k):
            total -= factor[k, i] * step[i]
        step[k] = total / factor[k, k]
    for k in range(p - 1, -1, -1):
        total = step[k]
        for i in range(k + 1, p):
            total -= factor[i, k] * step[i]
        step[k] = total / factor[k, k]
    return True


@njit(cache=True, error_model="numpy")
def _free_unknowns(u, gradient, free):
    """Which unknowns may move: all but those held at a bound by their gradient."""
    for k in range(u.size):
        free[k] = not ((u[k] >= 1.0 and gradient[k] < 0.0) or (u[k] <= -1.0 and gradient[k] > 0.0))


@njit(cache=True, error_model="numpy")
def workspace(n, p):
    """Scratch arrays of ``minimise`` for n samples and p unknowns."""
    vectors, samples = np.empty((5, p)), np.empty((2, n))
    matrices, jacobians = np.empty((2, p, p)), np.empty((2, n, p))
    return vectors, samples, matrices, jacobians, np.empty((n, p, p)), np.empty(p, dtype=np.bool_)


@njit(cache=True, error_model="numpy")
def minimise(model, samples, weights, tikhonov, u, residuals, jacobian, damping, bar, stop, work):
    """Descend from u (p,), in place, to a local minimum of a fold's loss.

    Args:
        model: kernel address, constants, theta0 (p,), s (p,).
        samples: positions (n, 2), times (n,), values (n,).
        weights: of the samples in the fold, (n,).
        tikhonov: tau.
        u: where to start; where it ends, (p,).
        residuals: at the end, written in place, (n,).
        jacobian: at the end, written in place, (n, p).
        damping: Marquardt's lambda at the start.
        bar: give up once the loss is about to settle above this.
        stop: at most so many evaluations; the scaled step that is the last.
        work: from ``workspace``.

    Returns:
        The loss and the number of evaluations used.
    """
    theta, second = work[0][0], work[4]
    second[:] = 0.0
    _place(model[2], model[3], u, theta)
    linearise(model[0], model[1], theta, samples[0], samples[1], samples[2], residuals, jacobian)
    loss, used = descend(
        model, samples, weights, tikhonov, u, residuals, jacobian, second, False, damping, bar, stop, work
    )
    return loss, used + 1


@njit(cache=True, error_model="numpy")
def descend(
    model, samples, weights, tikhonov, u, residuals, jacobian, second, newton, damping, bar, stop, work
):
    """``minimise`` where the residuals and their derivatives at the start are known.

    Args as there, and second: second derivatives by u, (n, p, p), 0 where unknown; newton: are they known?
    The last step, too small to be worth an evaluation, takes the residuals along by their derivatives.
    """
    kernel, constants, centre, scale = model
    positions, times, values = samples
    iterations, last = stop
    vectors, (trial_residuals, shifted), (matrix, factor), (trial_jacobian, spare), own, free = _unpack(work)
    theta, trial, gradient, step, metric = vectors
    loss, evaluations = loss_of(residuals, weights, u, tikhonov), 0
    _normal_equations(residuals, jacobian, weights, u, scale, tikhonov, matrix, gradient, metric)
    _add_curvature(residuals, second, weights, matrix)
    while evaluations < iterations and damping < _LARGEST:
        _free_unknowns(u, gradient, free)
        if not _solve(matrix, metric, gradient, free, damping, factor, step):
            damping = max(_GROW * damping, _FIRST)
            continue
        length = _advance(u, step, trial) * (1.0 + damping)
        if length <= (_NEWTON * last if newton else last):
            _move(u, trial, scale, jacobian, second, residuals)
            loss = loss_of(residuals, weights, u, tikhonov)
            break
        if _settles_above(bar, loss, gradient, step):
            break
        _place(centre, scale, trial, theta)
        linearise(kernel, constants, theta, positions, times, values, trial_residuals, trial_jacobian)
        trial_loss = loss_of(trial_residuals, weights, trial, tikhonov)
        evaluations += 1
        if not trial_loss <= loss:
            damping = max(_GROW * damping, _FIRST)
            continue
        damping = max(damping * _SHRINK, _LEAST)
        u[:], residuals[:], jacobian[:], loss = trial, trial_residuals, trial_jacobian, trial_loss
        if evaluations > _PATIENCE:
            second, newton = own, True
            second_derivatives(model, samples, u, jacobian, trial, theta, shifted, spare, second)
            evaluations += u.size
        _normal_equations(residuals, jacobian, weights, u, scale, tikhonov, matrix, gradient, metric)
        _add_curvature(residuals, second, weights, matrix)
    return loss, evaluations


@njit(cache=True, error_model="numpy")
def second_derivatives(model, samples, u, jacobian, trial, theta, shifted, spare, second):
    """Second derivatives of the residuals by u, (n, p, p), by differences of their exact first ones."""
    kernel, constants, centre, scale = model
    positions, times, values = samples
    for k in range(u.size):
        trial[:] = u
        trial[k] += _DIFFERENCE if u[k] < 0.0 else -_DIFFERENCE
        _place(centre, scale, trial, theta)
        linearise(kernel, constants, theta, positions, times, values, shifted, spare)
        for j in range(times.size):
            for m in range(u.size):
                second[j, k, m] = (spare[j, m] - jacobian[j, m]) * scale[m] / (trial[k] - u[k])


@njit(cache=True, error_model="numpy")
def _add_curvature(residuals, second, weights, matrix):
    """Add to the lower triangle what Gauss-Newton leaves out of the second derivatives."""
    for j in range(residuals.size):
        pull = weights[j] * residuals[j]
        for k in range(matrix.shape[0]):
            for m in range(k + 1):
                matrix[k, m] += pull * second[j, k, m]


@njit(cache=True, error_model="numpy")
def _move(u, trial, scale, jacobian, second, residuals):
    """Go to ``trial`` and take the residuals along by their first and second derivatives, in place."""
    for j in range(residuals.size):
        for k in range(u.size):
            step = trial[k] - u[k]
            residuals[j] += jacobian[j, k] * scale[k] * step
            for m in range(u.size):
                residuals[j] += 0.5 * second[j, k, m] * step * (trial[m] - u[m])
    u[:] = trial


@njit(cache=True, error_model="numpy")
def _settles_above(bar, loss, gradient, step):
    """Whether even several times the gain that the quadratic model promises leaves the loss above bar."""
    gain = 0.0
    for k in range(step.size):
        gain -= gradient[k] * step[k]
    return loss - _HOPE * gain > bar


@njit(cache=True, error_model="numpy")
def _unpack(work):
    vectors, samples, matrices, jacobians, second, free = work
    return (
        (vectors[0], vectors[1], vectors[2], vectors[3], vectors[4]),
        (samples[0], samples[1]),
        (matrices[0], matrices[1]),
        (jacobians[0], jacobians[1]),
        second,
        free,
    )


@njit(cache=True, error_model="numpy")
def _place(centre, scale, u, theta):
    """theta = theta0 + s u, in place."""
    for k in range(u.size):
        theta[k] = centre[k] + scale[k] * u[k]


@njit(cache=True, error_model="numpy")
def _advance(u, step, trial):
    """u + step within the box, written into ``trial``; returns the largest move."""
    moved = 0.0
    for k in range(u.size):
        trial[k] = min(1.0, max(-1.0, u[k] + step[k]))
        moved = max(moved, abs(trial[k] - u[k]))
    return moved


@njit(cache=True, error_model="numpy")
def spread(loss, n, work, weakest):
    """Largest standard deviation of a scaled unknown where the last descent ended, n samples having the
    loss for variance; the direction of least certainty, of any length, goes into ``weakest`` (p,)."""
    (_, _, gradient, step, metric), _, (matrix, factor), _, _, free = _unpack(work)
    free[:] = True
    largest = 0.0
    for k in range(step.size):
        gradient[:], gradient[k] = 0.0, -1.0
        if not _solve(matrix, metric, gradient, free, 0.0, factor, step):
            weakest[:] = 1.0
            return np.inf
        if step[k] > largest:
            largest = step[k]
            weakest[:] = step
    return math.sqrt(loss / max(n, 1) * largest)
