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
)
from fieldrl.estimator.levenberg_marquardt import (
    descend,
    loss_of,
    minimise,
    second_derivatives,
    spread,
    workspace,
)

_SAME = 1e-5  # minima closer than this in every scaled unknown are one
_PROMISING = 4.0  # a known minimum is a start when its loss is below this times the best
_DETERMINED = 0.07  # a minimum known to this part of a grid cell has no twin closer than the grid sees
_FEW = 6  # with fewer samples a fold's lowest grid points are starts, local minima or not,
_MORE = 4  # and so many times the starts are made, for every fold
_NEAR, _FAR = 1e-6, 1e-3  # first damping from a known minimum, from a grid point


@njit(cache=True, error_model="numpy")
def local_fits(model, samples, tikhonov, weights, stop, u, loss, residuals):
    """Every fold by one descent from theta0; results written in place. Returns the evaluations used."""
    work, evaluations = workspace(samples[1].size, u.shape[1]), 0
    jacobian = np.empty((samples[1].size, u.shape[1]))
    for fold in range(len(weights)):
        u[fold] = 0.0
        loss[fold], used = minimise(
            model,
            samples,
            weights[fold],
            tikhonov,
            u[fold],
            residuals[fold],
            jacobian,
            _FAR,
            np.inf,
            stop,
            work,
        )
        evaluations += used
    return evaluations


@njit(cache=True, error_model="numpy")
def global_fit(model, samples, tikhonov, weights, search, starts, stop, u, loss, residuals):
    """Fold 0 alone, without a memo, for any number of samples. Returns the evaluations used."""
    positions, times, values = samples
    grid, theta, neighbours, cell = search
    total, row, n, p = np.zeros(len(grid)), np.empty(len(grid)), times.size, grid.shape[1]
    for j in range(n):
        squared_residuals(model[0], model[1], theta, positions[j], times[j : j + 1], values[j], row)
        total += row
    lowest = np.empty(starts, dtype=np.int64)
    found = lowest_minima(_grid_losses(total, grid, n, tikhonov), neighbours, lowest)
    minima, work = _minima(starts, n, p), workspace(n, p)
    loss[0], best, _, evaluations = _full_fit(
        model, samples, weights[0], tikhonov, grid, lowest[:found], cell, minima, stop, work
    )
    u[0], residuals[0] = minima[0][best], minima[1][best]
    return evaluations + len(grid)


@njit(cache=True, error_model="numpy")
def global_fits(model, samples, tikhonov, weights, search, memo, starts, stop, u, loss, residuals):
    """All n + 1 folds, each to its global minimum; results written in place.

    Args:
        model: kernel address, constants, theta0 (p,), s (p,).
        samples: positions (n, 2), times (n,), values (n,), with n >= 1.
        tikhonov: tau.
        weights: of the samples in each fold, (n + 1, n).
        search: the grid's u (G, p), theta (G, p), neighbours (G, 2p) and spacing in u.
        memo: labels (capacity, 4), squared residuals, their running sums and maxima (capacity, G).
        starts: descend from at most so many local minima of the grid.
        stop: at most so many evaluations a descent; the scaled step that is the last.
        u: minimisers, (n + 1, p).
        loss: penalised losses, (n + 1,).
        residuals: at the minimisers, (n + 1, n).

    Returns:
        Evaluations used, one for each candidate at n samples.
    """
    grid, theta, neighbours, cell = search
    n, p, few = samples[1].size, grid.shape[1], samples[1].size < _FEW
    refresh(model, theta, samples, memo)
    squared, total, largest = memo[1], memo[2][n - 1], memo[3][n - 1]
    if few:
        starts *= _MORE
    lowest = np.empty(starts, dtype=np.int64)
    found = lowest_minima(_grid_losses(total, grid, n, tikhonov), neighbours, lowest)
    minima, work = _minima(starts, n, p), workspace(n, p)
    loss[0], best, count, evaluations = _full_fit(
        model, samples, weights[0], tikhonov, grid, lowest[:found], cell, minima, stop, work
    )
    u[0], residuals[0] = minima[0][best], minima[1][best]
    _add_second_derivatives(model, samples, weights[0], tikhonov, minima, count, loss[0], work)
    open_cells = _open_cells(total, largest, lowest[:found])
    own = np.empty(starts, dtype=np.int64)
    scratch = np.empty(p), np.empty(n), np.empty((n, p)), np.empty((2, p)), np.empty(p)
    for fold in range(1, n + 1):
        extra = _own_minima(total, squared[fold - 1], few, open_cells, lowest[:found], neighbours, own)
        loss[fold], used = _fold_fit(
            model, samples, weights[fold], tikhonov, minima, count, grid, own[:extra], cell,
            stop, work, scratch, u[fold], residuals[fold],
        )  # fmt: skip
        evaluations += used
    return evaluations + len(grid)


@njit(cache=True, error_model="numpy")
def _grid_losses(total, grid, n, tikhonov):
    """The penalised loss of fold 0 on the grid, (G,)."""
    losses, share = np.empty(total.size), 1.0 / max(n, 1)
    for g in range(len(grid)):
        losses[g] = total[g] * share
        for k in range(grid.shape[1]):
            losses[g] += tikhonov * grid[g, k] * grid[g, k]
    return losses


@njit(cache=True, error_model="numpy")
def _minima(starts, n, p):
    """Room for distinct minima: u, residuals and their first and second derivatives."""
    room = starts + 2
    return np.empty((room, p)), np.empty((room, n)), np.empty((room, n, p)), np.zeros((room, n, p, p))


@njit(cache=True, error_model="numpy")
def _full_fit(model, samples, weights, tikhonov, grid, lowest, cell, minima, stop, work):
    """Descend from the chosen grid points, and beside the best minimum if that is poorly determined;
    keep the distinct minima with their residuals and Jacobians.

    Returns:
        Least loss, its place, number of distinct minima, evaluations.
    """
    places, residuals, jacobians, _ = minima
    p, count, best, least, evaluations = grid.shape[1], 0, 0, np.inf, 0
    beside, weakest, width = np.empty((2, p)), np.empty(p), 0.0
    for start in range(len(lowest) + 2):
        if start < len(lowest):
            places[count] = grid[lowest[start]]
        elif width < _DETERMINED * cell:
            break
        else:
            if start == len(lowest):
                _shift(places[best], weakest, cell, beside)
            places[count] = beside[start - len(lowest)]
        reached, used = minimise(
            model, samples, weights, tikhonov, places[count], residuals[count], jacobians[count],
            _FAR, least, stop, work,
        )  # fmt: skip
        evaluations += used
        if _is_new(places, count):
            if reached < least:
                least, best, width = reached, count, spread(reached, samples[1].size, work, weakest)
            count += 1
    return least, best, count, evaluations


@njit(cache=True, error_model="numpy")
def _add_second_derivatives(model, samples, weights, tikhonov, minima, count, least, work):
    """Second derivatives at the minima that the folds are likely to start from, in place."""
    places, residuals, jacobians, second = minima
    theta, trial, shifted, spare = work[0][0], work[0][1], work[1][1], work[3][1]
    for m in range(count):
        if loss_of(residuals[m], weights, places[m], tikhonov) <= _PROMISING * least:
            second_derivatives(
                model, samples, places[m], jacobians[m], trial, theta, shifted, spare, second[m]
            )


@njit(cache=True, error_model="numpy")
def _shift(u, weakest, cell, beside):
    """Points one grid cell either way from u along its least determined direction, in the box, (2, p)."""
    longest = 0.0
    for k in range(u.size):
        longest = max(longest, abs(weakest[k]))
    for k in range(u.size):
        move = cell * weakest[k] / longest
        beside[0, k] = min(1.0, max(-1.0, u[k] - move))
        beside[1, k] = min(1.0, max(-1.0, u[k] + move))


@njit(cache=True, error_model="numpy")
def _is_new(places, count):
    """Whether the minimum at ``count`` differs from all before it."""
    for m in range(count):
        farthest = 0.0
        for k in range(places.shape[1]):
            farthest = max(farthest, abs(places[m, k] - places[count, k]))
        if farthest < _SAME:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _open_cells(total, largest, lowest):
    """Grid points that, less one sample, may lie below the highest start of the full fit."""
    bar = 0.0
    for g in lowest:
        bar = max(bar, total[g])
    return np.flatnonzero(total - largest <= bar)


@njit(cache=True, error_model="numpy")
def _holds(places, g):
    for place in places:  # noqa: SIM110 - numba compiles no generator expressions
        if place == g:
            return True
    return False


@njit(cache=True, error_model="numpy")
def _own_minima(total, row, few, open_cells, lowest, neighbours, own):
    """Lowest grid points less one sample that are no start of the full fit; returns their number."""
    found = 0
    for g in open_cells:
        if found == own.size and total[g] - row[g] >= total[own[-1]] - row[own[-1]]:
            continue
        if (few or is_minimum(total, row, g, neighbours)) and not _holds(lowest, g):
            found = insert(total, row, own, found, g)
    return found


@njit(cache=True, error_model="numpy")
def _fold_fit(
    model, samples, weights, tikhonov, minima, known, grid, own, cell, stop, work, scratch, u, residuals
):
    """One fold from the full fit's minima, from its own grid minima, and beside the best of these where
    it is poorly determined. Returns its loss and the evaluations."""
    trial, trial_residuals, trial_jacobian, beside, weakest = scratch
    places, kept, jacobians, second = minima
    chosen = known + len(own)
    outlook, least, evaluations, width = np.empty(known), np.inf, 0, 0.0
    for m in range(known):
        outlook[m] = loss_of(kept[m], weights, places[m], tikhonov)
    bar = _PROMISING * outlook.min()
    for start in range(chosen + 2):
        if start < known:
            if outlook[start] > bar:
                continue
            trial[:], trial_residuals[:], trial_jacobian[:] = places[start], kept[start], jacobians[start]
            reached, used = descend(
                model, samples, weights, tikhonov, trial, trial_residuals, trial_jacobian,
                second[start], True, _NEAR, least, stop, work,
            )  # fmt: skip
        else:
            if start < chosen:
                trial[:] = grid[own[start - known]]
            elif width < _DETERMINED * cell:
                break
            else:
                if start == chosen:
                    _shift(u, weakest, cell, beside)
                trial[:] = beside[start - chosen]
            reached, used = minimise(
                model, samples, weights, tikhonov, trial, trial_residuals, trial_jacobian,
                _FAR, least, stop, work,
            )  # fmt: skip
        evaluations += used
        if reached < least:
            least, width = reached, spread(reached, residuals.size - 1, work, weakest)
            u[:], residuals[:] = trial, trial_residuals
    return least, evaluations
