"""All folds of a fit problem, each to its global minimum: a coarse search, then Levenberg-Marquardt.

The full fit (fold 0) descends from the lowest local minima of the grid. A fold that leaves one sample
out is a small change of it: it starts from the minima already found, whose residuals are known, and
from those of its own grid minima that lie lower than the full fit's starts.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fieldrl.estimator.coarse_search import (
    insert,
    is_minimum,
    lowest_minima,
    refresh,
    squared_residuals,
    totals,
)
from fieldrl.estimator.levenberg_marquardt import loss_of, minimise, workspace

_SAME = 1e-5  # minima closer than this in every scaled unknown are one
_PROMISING = 4.0  # a known minimum is a start when its loss is below this times the best
_FEW = 13  # with fewer samples a minimum may have a twin closer than the grid sees
_NEAR, _FAR = 1e-6, 1e-3  # first damping from a known minimum, from a grid point


@njit(cache=True)
def local_fits(model, samples, tikhonov, weights, stop, u, loss, residuals):
    """Every fold by one descent from theta0; results written in place. Returns the evaluations used."""
    work, evaluations = workspace(samples[1].size, u.shape[1]), 0
    for fold in range(len(weights)):
        u[fold] = 0.0
        loss[fold], used = minimise(
            model, samples, weights[fold], tikhonov, u[fold], residuals[fold], _FAR, np.inf, stop, work
        )
        evaluations += used
    return evaluations


@njit(cache=True)
def global_fit(model, samples, tikhonov, weights, search, starts, stop, u, loss, residuals):
    """Fold 0 alone, without a memo, for any number of samples. Returns the evaluations used."""
    positions, times, values = samples
    grid, theta, points = search
    total, row = np.zeros(len(grid)), np.empty(len(grid))
    for j in range(times.size):
        squared_residuals(model[0], model[1], theta, positions[j], times[j : j + 1], values[j], row)
        total += row
    losses = _grid_losses(total, grid, times.size, tikhonov)
    lowest, work = np.empty(starts, dtype=np.int64), workspace(times.size, u.shape[1])
    found = lowest_minima(losses, points, grid.shape[1], lowest)
    minima, kept = np.empty((starts, u.shape[1])), np.empty((starts, times.size))
    loss[0], best, _, evaluations = _full_fit(
        model, samples, weights[0], tikhonov, grid, lowest[:found], minima, kept, stop, work
    )
    u[0], residuals[0] = minima[best], kept[best]
    return evaluations + len(grid)


@njit(cache=True)
def global_fits(model, samples, tikhonov, weights, search, memo, starts, stop, u, loss, residuals):
    """All n + 1 folds, each to its global minimum; results written in place.

    Args:
        model: kernel address, constants, theta0 (p,), s (p,).
        samples: positions (n, 2), times (n,), values (n,).
        tikhonov: tau.
        weights: of the samples in each fold, (n + 1, n).
        search: the grid's u (G, p), theta (G, p) and points along each dimension.
        memo: labels (capacity, 4) and squared residuals (capacity, G).
        starts: descend from at most so many local minima of the grid.
        stop: at most so many evaluations a descent; the scaled step that is negligible.
        u: minimisers, (n + 1, p).
        loss: penalised losses, (n + 1,).
        residuals: at the minimisers, (n + 1, n).

    Returns:
        Evaluations used, one for each candidate at n samples.
    """
    positions, times, values = samples
    grid, theta, points = search
    labels, squared = memo
    n, p, size = times.size, grid.shape[1], len(grid)
    refresh(model[0], model[1], theta, positions, times, values, labels, squared)
    total, largest = np.empty(size), np.empty(size)
    totals(squared, n, total, largest)
    lowest, work = np.empty(starts, dtype=np.int64), workspace(n, p)
    losses = _grid_losses(total, grid, n, tikhonov)
    found = lowest_minima(losses, points, p, lowest)
    minima, kept = np.empty((starts, p)), np.empty((starts, n))
    loss[0], best, count, evaluations = _full_fit(
        model, samples, weights[0], tikhonov, grid, lowest[:found], minima, kept, stop, work
    )
    u[0], residuals[0] = minima[best], kept[best]
    open_cells = _open_cells(total, largest, lowest[:found])
    own, fold_losses = np.empty(starts, dtype=np.int64), np.empty(size)
    for fold in range(1, n + 1):
        extra = _own_minima(total, squared[fold - 1], open_cells, lowest[:found], points, p, fold_losses, own)
        loss[fold], used = _fold_fit(
            model, samples, weights[fold], tikhonov, minima[:count], kept, grid, own[:extra],
            stop, work, u[fold], residuals[fold],
        )  # fmt: skip
        evaluations += used
    if n < _FEW:
        for fold in range(n + 1):
            loss[fold], used = _twin(
                model, samples, weights[fold], tikhonov, 2.0 / points, loss[fold], stop, work,
                u[fold], residuals[fold],
            )  # fmt: skip
            evaluations += used
    return evaluations + size


@njit(cache=True)
def _grid_losses(total, grid, n, tikhonov):
    """The penalised loss of fold 0 on the grid, (G,)."""
    losses = total / max(n, 1)
    for g in range(len(grid)):
        for k in range(grid.shape[1]):
            losses[g] += tikhonov * grid[g, k] ** 2
    return losses


@njit(cache=True)
def _full_fit(model, samples, weights, tikhonov, grid, lowest, minima, kept, stop, work):
    """Descend from the chosen grid points and keep the distinct minima with their residuals.

    Returns:
        Least loss, its place, number of distinct minima, evaluations.
    """
    count, best, least, evaluations = 0, 0, np.inf, 0
    for g in lowest:
        minima[count] = grid[g]
        reached, used = minimise(
            model, samples, weights, tikhonov, minima[count], kept[count], _FAR, least, stop, work
        )
        evaluations += used
        if _is_new(minima, count):
            if reached < least:
                least, best = reached, count
            count += 1
    return least, best, count, evaluations


@njit(cache=True)
def _is_new(minima, count):
    for m in range(count):
        if np.max(np.abs(minima[m] - minima[count])) < _SAME:
            return False
    return True


@njit(cache=True)
def _open_cells(total, largest, lowest):
    """Grid points that, less one sample, may lie below the highest start of the full fit."""
    bar = 0.0
    for g in lowest:
        bar = max(bar, total[g])
    return np.flatnonzero(total - largest <= bar)


@njit(cache=True)
def _own_minima(total, row, open_cells, lowest, points, p, losses, own):
    """Local minima of the grid less one sample that are no start of the full fit; returns their number."""
    for g in range(total.size):
        losses[g] = total[g] - row[g]
    found = 0
    for g in open_cells:
        if found == own.size and losses[g] >= losses[own[found - 1]]:
            continue
        if is_minimum(losses, g, points, p) and not np.any(lowest == g):
            found = insert(losses, own, found, g)
    return found


@njit(cache=True)
def _fold_fit(model, samples, weights, tikhonov, minima, kept, grid, own, stop, work, u, residuals):
    """One fold from the full fit's minima and its own grid minima. Returns its loss and evaluations."""
    outlook, least, evaluations = np.empty(len(minima)), np.inf, 0
    for m in range(len(minima)):
        outlook[m] = loss_of(kept[m], weights, minima[m], tikhonov)
    bar = _PROMISING * outlook.min()
    trial, trial_residuals = np.empty(u.size), np.empty(residuals.size)
    for m in range(len(minima) + len(own)):
        if m < len(minima) and outlook[m] > bar:
            continue
        trial[:] = minima[m] if m < len(minima) else grid[own[m - len(minima)]]
        damping = _NEAR if m < len(minima) else _FAR
        reached, used = minimise(
            model, samples, weights, tikhonov, trial, trial_residuals, damping, least, stop, work
        )
        evaluations += used
        if reached < least:
            least = reached
            u[:], residuals[:] = trial, trial_residuals
    return least, evaluations


@njit(cache=True)
def _twin(model, samples, weights, tikhonov, cell, least, stop, work, u, residuals):
    """Look for a lower minimum one grid cell away from u along each axis, in place."""
    centre, evaluations = u.copy(), 0
    trial, trial_residuals = np.empty(u.size), np.empty(residuals.size)
    for k in range(2 * u.size):
        trial[:] = centre
        trial[k // 2] = min(1.0, max(-1.0, trial[k // 2] + (cell if k % 2 else -cell)))
        reached, used = minimise(
            model, samples, weights, tikhonov, trial, trial_residuals, _FAR, least, stop, work
        )
        evaluations += used
        if reached < least:
            least = reached
            u[:], residuals[:] = trial, trial_residuals
    return least, evaluations
