"""Levenberg-Marquardt for the folds of a fit problem, compiled; the model is called by address.

Works in scaled unknowns u = (theta - theta0) / s, so the bounds are the box |u| <= 1, kept by
projection: an unknown at its bound whose gradient points outwards stays there (an active set).
Gauss-Newton is slow in curved valleys and where residuals stay large; a descent that takes long goes
on with the true second derivatives, by differences of the exact gradient. Symbols as in ``normal_equations``.
"""

from __future__ import annotations

import numpy as np

from fieldrl.core.compiled import call_model, loop
from fieldrl.estimator.descent.normal_equations import assemble, copy, damped_step

_SHRINK, _GROW = 0.2, 4.0  # of the damping after success and failure
_LEAST, _FIRST, _LARGEST = 1e-12, 1e-5, 1e14  # damping: least, after a first failure, largest
_PATIENCE = 12  # evaluations after which Gauss-Newton is slow and Newton's matrix pays
_DIFFERENCE = 1e-6  # shift of a scaled unknown for second derivatives
_HOPE = 10.0  # a descent may gain so many times what its quadratic model promises


@loop
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


@loop
def loss_of(residuals, weights, u, tikhonov):
    """The penalised loss of a fold."""
    total = 0.0
    for j in range(residuals.size):
        total += weights[j] * residuals[j] * residuals[j]
    for k in range(u.size):
        total += tikhonov * u[k] * u[k]
    return total


@loop
def _free_unknowns(u, gradient, free):
    """Which unknowns may move: all but those held at a bound by their gradient."""
    for k in range(u.size):
        free[k] = not ((u[k] >= 1.0 and gradient[k] < 0.0) or (u[k] <= -1.0 and gradient[k] > 0.0))


@loop
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
        The loss, the number of evaluations used, and the gap: how far the loss lies above its minimum by the
        quadratic model where the descent ended; infinite where it was given up.
    """
    state, scratch = work
    _, curvature, _, _ = state
    curvature[:] = 0.0
    theta = scratch[0][0]
    _place(model[2], model[3], u, theta)
    linearise(model[0], model[1], theta, samples[0], samples[1], samples[2], residuals, jacobian)
    assemble(residuals, jacobian, weights, u, model[3], tikhonov, state)
    loss = loss_of(residuals, weights, u, tikhonov)
    loss, used, gap = descend(
        model, samples, weights, tikhonov, u, residuals, jacobian, loss, damping, bar, stop, work
    )
    return loss, used + 1, gap


@loop
def descend(model, samples, weights, tikhonov, u, residuals, jacobian, loss, damping, bar, stop, work):
    """``minimise`` from a start where everything is known: residuals, Jacobian, loss, and the state in work.

    C is kept until the descent takes long. The last step, too small to be worth an evaluation, takes the
    residuals along by their derivatives.
    """
    kernel, constants, centre, scale = model
    positions, times, values = samples
    iterations, last = stop
    state, (vectors, factor, trial_residuals, trial_jacobian, free) = work
    theta, trial, step = vectors[0], vectors[1], vectors[2]
    gradient, evaluations, gap = state[2], 0, np.inf
    while evaluations < iterations and damping < _LARGEST:
        _free_unknowns(u, gradient, free)
        if not damped_step(state, free, damping, factor, step):
            damping = max(_GROW * damping, _FIRST)
            continue
        length = _advance(u, step, trial) * (1.0 + damping)
        if length <= last:
            gap = _gain(gradient, step) * (1.0 + damping)
            _move(u, trial, scale, jacobian, residuals)
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
        damping, loss = max(damping * _SHRINK, _LEAST), trial_loss
        copy_point(trial, trial_residuals, trial_jacobian, u, residuals, jacobian)
        if evaluations > _PATIENCE:
            _refresh_curvature(model, samples, weights, u, residuals, jacobian, work)
            evaluations += u.size
        assemble(residuals, jacobian, weights, u, scale, tikhonov, state)
    return loss, evaluations, gap


@loop
def copy_point(u, residuals, jacobian, to_u, to_residuals, to_jacobian):
    """Copy a point and what is known there."""
    copy(u, to_u)
    copy(residuals, to_residuals)
    for j in range(residuals.size):
        copy(jacobian[j], to_jacobian[j])


@loop
def _refresh_curvature(model, samples, weights, u, residuals, jacobian, work):
    """C at u, written into the state: second derivatives by differences of the exact first ones."""
    state, (vectors, _, spare_residuals, spare, _) = work
    curvature, scale = state[1], model[3]
    for k in range(u.size):
        shift = shifted(model, samples, u, k, vectors, spare_residuals, spare)
        for m in range(u.size):
            total = 0.0
            for j in range(residuals.size):
                total += weights[j] * residuals[j] * (spare[j, m] - jacobian[j, m])
            curvature[k, m] = total * scale[m] / shift


@loop
def shifted(model, samples, u, k, vectors, residuals, jacobian):
    """Residuals and Jacobian beside u, unknown k a little farther from its bound; returns the shift."""
    theta, trial = vectors[0], vectors[1]
    copy(u, trial)
    trial[k] += _DIFFERENCE if u[k] < 0.0 else -_DIFFERENCE
    _place(model[2], model[3], trial, theta)
    linearise(model[0], model[1], theta, samples[0], samples[1], samples[2], residuals, jacobian)
    return trial[k] - u[k]


@loop
def _move(u, trial, scale, jacobian, residuals):
    """Go to ``trial`` and take the residuals along by their derivatives, in place."""
    for k in range(u.size):
        step = (trial[k] - u[k]) * scale[k]
        for j in range(residuals.size):
            residuals[j] += jacobian[j, k] * step
        u[k] = trial[k]


@loop
def _settles_above(bar, loss, gradient, step):
    """Whether even several times the gain that the quadratic model promises leaves the loss above bar."""
    return loss - _HOPE * _gain(gradient, step) > bar


@loop
def _gain(gradient, step):
    """What the quadratic model promises of a step."""
    gain = 0.0
    for k in range(step.size):
        gain -= gradient[k] * step[k]
    return gain


@loop
def _place(centre, scale, u, theta):
    """theta = theta0 + s u, in place."""
    for k in range(u.size):
        theta[k] = centre[k] + scale[k] * u[k]


@loop
def _advance(u, step, trial):
    """u + step within the box, written into ``trial``; returns the largest move."""
    moved = 0.0
    for k in range(u.size):
        trial[k] = min(1.0, max(-1.0, u[k] + step[k]))
        moved = max(moved, abs(trial[k] - u[k]))
    return moved
