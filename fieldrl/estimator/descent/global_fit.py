"""All folds of a fit problem, each to its global minimum: a coarse search, then Levenberg-Marquardt.

The full fit (fold 0) descends from the lowest local minima of the grid. A fold that leaves one sample
out is a small change of it: it starts from the minima already found, whose residuals are known, and
from those of its own grid minima that lie lower than the full fit's starts.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fieldrl.core.compiled import loop
from fieldrl.estimator.descent.coarse_search import (
    insert,
    is_minimum,
    lowest_minima,
    refresh,
    squared_residuals,
)
from fieldrl.estimator.descent.leave_one_out import FAR, expand, fold_fit, fold_scratch, shift
from fieldrl.estimator.descent.levenberg_marquardt import copy_point, minimise
from fieldrl.estimator.descent.normal_equations import spread, workspace

_SAME = 1e-5  # minima closer than this in every scaled unknown are one
_DETERMINED = 0.07  # a minimum known to this part of a grid cell has no twin closer than the grid sees
_FEW = 6  # with fewer samples a fold's lowest grid points are starts, local minima or not,
_MORE = 4  # and so many times the starts are made, for every fold


@njit(cache=True, error_model="numpy")
def local_fits(model, samples, tikhonov, weights, stop, u, loss, residuals, gap):
    """Every fold by one descent from theta0; results written in place. Returns the evaluations used."""
    work, evaluations = workspace(samples[1].size, u.shape[1]), 0
    jacobian = np.empty((samples[1].size, u.shape[1]))
    for fold in range(len(weights)):
        u[fold] = 0.0
        loss[fold], used, gap[fold] = minimise(
            model,
            samples,
            weights[fold],
            tikhonov,
            u[fold],
            residuals[fold],
            jacobian,
            FAR,
            np.inf,
            stop,
            work,
        )
        evaluations += used
    return evaluations


@njit(cache=True, error_model="numpy")
def global_fit(model, samples, tikhonov, weights, search, starts, stop, u, loss, residuals, gap):
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
    loss[0], gap[0], _, evaluations = _full_fit(
        model, samples, weights[0], tikhonov, grid, lowest[:found], cell, minima, stop, work
    )
    u[0], residuals[0] = minima[0][0], minima[1][0]
    return evaluations + len(grid)


@njit(cache=True, error_model="numpy")
def global_fits(model, samples, tikhonov, weights, search, memo, starts, stop, u, loss, residuals, gap):
    """Fold 0 and, with weights of them, the n others, each to its global minimum; results written in place.

    Args:
        model: kernel address, constants, theta0 (p,), s (p,).
        samples: positions (n, 2), times (n,), values (n,), with n >= 1.
        tikhonov: tau.
        weights: of the samples in each fold, (n + 1, n); in fold 0 alone, (1, n).
        search: the grid's u (G, p), theta (G, p), neighbours (G, 2p) and spacing in u.
        memo: labels (capacity, 4), squared residuals, their running sums and maxima (capacity, G).
        starts: descend from at most so many local minima of the grid.
        stop: at most so many evaluations a descent; the scaled step that is the last.
        u: minimisers, (folds, p).
        loss: penalised losses, (folds,).
        residuals: at the minimisers, (folds, n).
        gap: how far each loss may lie above its minimum, (folds,).

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
    loss[0], gap[0], count, evaluations = _full_fit(
        model, samples, weights[0], tikhonov, grid, lowest[:found], cell, minima, stop, work
    )
    u[0], residuals[0] = minima[0][0], minima[1][0]
    if len(weights) == 1:
        return evaluations + len(grid)
    expansion = expand(minima, count)
    open_cells = _open_cells(total, largest, lowest[:found])
    own = np.empty(starts, dtype=np.int64)
    scratch = fold_scratch(n, p)
    for out in range(n):
        extra = _own_minima(total, squared[out], few, open_cells, lowest[:found], neighbours, own)
        loss[1 + out], used = fold_fit(
            model, samples, weights[1 + out], tikhonov, out, minima, expansion, grid, own[:extra], cell,
            stop, work, scratch, (u[1 + out], residuals[1 + out], gap[1 + out : 2 + out]),
        )  # fmt: skip
        evaluations += used
    return evaluations + len(grid)


@njit(cache=True, error_model="numpy")
def many_fits(
    kernel, constants, box, samples, which, tikhonov, weights, search, memos, starts, stop,
    u, loss, residuals, gap, evaluations,
):  # fmt: skip
    """``global_fits`` of many problems that have n samples each, one after the other.

    Args:
        kernel: address of the model's compiled function.
        constants: what it needs in each problem, (B, k).
        box: theta0 (p,), s (p,).
        samples: positions (B, capacity, 2), times (B, capacity), values (B, capacity).
        which: the problems that are fitted, (b,), of all B.
        tikhonov: tau.
        weights: of the samples in each fold, (n + 1, n); in fold 0 alone, (1, n).
        search: as in ``global_fits``.
        memos: of each problem, with B in front.
        starts: as in ``global_fits``.
        stop: as in ``global_fits``.
        u: minimisers, (b, folds, p).
        loss: (b, folds).
        residuals: (b, folds, n).
        gap: (b, folds).
        evaluations: used, (b,).
    """
    n = weights.shape[1]
    for b in range(which.size):
        i = which[b]
        model = kernel, constants[i], box[0], box[1]
        taken = samples[0][i, :n], samples[1][i, :n], samples[2][i, :n]
        memo = memos[0][i], memos[1][i], memos[2][i], memos[3][i]
        evaluations[b] = global_fits(
            model, taken, tikhonov, weights, search, memo, starts, stop, u[b], loss[b], residuals[b], gap[b]
        )


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
    """Room for distinct minima: u, residuals and Jacobian."""
    room = starts + 3
    return np.empty((room, p)), np.empty((room, n)), np.empty((room, n, p))


@njit(cache=True, error_model="numpy")
def _full_fit(model, samples, weights, tikhonov, grid, lowest, cell, minima, stop, work):
    """Descend from the chosen grid points, and beside the best minimum if that is poorly determined;
    keep the distinct minima with their residuals and Jacobians, the best one first.

    Returns:
        Least loss, its gap, number of distinct minima, evaluations.
    """
    places, residuals, jacobians = minima
    p, count, best, least, evaluations = grid.shape[1], 0, 0, np.inf, 0
    beside, weakest, width, closest = np.empty((2, p)), np.empty(p), 0.0, np.inf
    for start in range(len(lowest) + 2):
        if start < len(lowest):
            places[count] = grid[lowest[start]]
        elif width < _DETERMINED * cell:
            break
        else:
            if start == len(lowest):
                shift(places[best], weakest, cell, beside)
            places[count] = beside[start - len(lowest)]
        reached, used, gap = minimise(
            model, samples, weights, tikhonov, places[count], residuals[count], jacobians[count],
            FAR, least, stop, work,
        )  # fmt: skip
        evaluations += used
        if _is_new(places, count):
            if reached < least:
                least, best, closest = reached, count, gap
                width = spread(reached, samples[1].size, work, weakest)
            count += 1
    _swap(minima, 0, best)
    return least, closest, count, evaluations


@loop
def _swap(minima, first, second):
    """Exchange two minima; the last place is spare."""
    places, residuals, jacobians = minima
    for source, target in ((first, -1), (second, first), (-1, second)):
        copy_point(
            places[source], residuals[source], jacobians[source],
            places[target], residuals[target], jacobians[target],
        )  # fmt: skip


@loop
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


@loop
def _holds(places, g):
    for place in places:  # noqa: SIM110 - numba compiles no generator expressions
        if place == g:
            return True
    return False


@loop
def _own_minima(total, row, few, open_cells, lowest, neighbours, own):
    """Lowest grid points less one sample that are no start of the full fit; returns their number."""
    found = 0
    for g in open_cells:
        if found == own.size and total[g] - row[g] >= total[own[-1]] - row[own[-1]]:
            continue
        if (few or is_minimum(total, row, g, neighbours)) and not _holds(lowest, g):
            found = insert(total, row, own, found, g)
    return found
