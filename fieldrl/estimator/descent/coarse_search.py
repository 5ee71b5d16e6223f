"""A coarse grid over the box of the bounds, on which squared residuals are kept per sample.

A fold's loss on the grid is the total of all samples less one row, so a new sample costs one new row
and every fold's starting points follow from sums. The rows are a memo: each is labelled with its
sample, computed again where a label differs, and changes no result.

| symbol | meaning | shape |
|---|---|---|
| u | grid points, scaled unknowns | (G, p) |
| squared | squared residuals of each sample | (capacity, G) |
| total, largest | running sum and maximum of the rows | (capacity, G) |
| labels | the sample (x, y, t, value) of each row | (capacity, 4) |
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.core.compiled import call_model, loop


def box_grid(points: int, p: int) -> NDArray[np.float64]:
    """The regular grid of ``points`` ** ``p`` cell centres of the box |u| <= 1, (G, p), last fastest."""
    axis = np.linspace(-1.0, 1.0, 2 * points + 1)[1::2]
    return np.stack(np.meshgrid(*[axis] * p, indexing="ij"), axis=-1).reshape(-1, p)


def axis_neighbours(points: int, p: int) -> NDArray[np.int64]:
    """The 2p neighbours of each grid point along the axes, itself where there is none, (G, 2p)."""
    place = np.arange(points**p).reshape((points,) * p)
    columns = []
    for axis in range(p):
        for shift in (-1, 1):
            along = np.clip(np.arange(points) + shift, 0, points - 1)
            columns.append(np.take(place, along, axis=axis).ravel())
    return np.ascontiguousarray(np.stack(columns, axis=-1))


@njit(cache=True, error_model="numpy")
def squared_residuals(kernel, constants, theta, position, time, value, row):
    """Squared residual of one sample at the grid's parameters (G, p), written into ``row`` (G,)."""
    m, p = theta.shape
    jacobian = np.empty((m, 1, p))
    call_model(
        kernel,
        theta.ctypes,
        m,
        position.ctypes,
        time.ctypes,
        1,
        constants.ctypes,
        row.ctypes,
        jacobian.ctypes,
    )
    for g in range(m):
        row[g] = (row[g] - value) ** 2


@njit(cache=True, error_model="numpy")
def refresh(model, theta, samples, memo):
    """Bring the memo's first n rows up to date with the samples; returns how many were computed."""
    labels, squared, total, largest = memo
    positions, times, values = samples
    first = _first_change(labels, positions, times, values)
    for j in range(first, times.size):
        squared_residuals(model[0], model[1], theta, positions[j], times[j : j + 1], values[j], squared[j])
        for g in range(theta.shape[0]):
            total[j, g] = squared[j, g] + (total[j - 1, g] if j else 0.0)
            largest[j, g] = max(squared[j, g], largest[j - 1, g]) if j else squared[j, g]
        labels[j, 0], labels[j, 1] = positions[j, 0], positions[j, 1]
        labels[j, 2], labels[j, 3] = times[j], values[j]
    if times.size < len(labels):
        labels[times.size :] = np.nan
    return times.size - first


@loop
def _first_change(labels, positions, times, values):
    """The first sample that the memo does not hold, n where it holds all."""
    for j in range(times.size):
        same = labels[j, 0] == positions[j, 0] and labels[j, 1] == positions[j, 1]
        if not (same and labels[j, 2] == times[j] and labels[j, 3] == values[j]):
            return j
    return times.size


@loop
def is_minimum(total, row, g, neighbours):
    """Whether total - row at grid point g is not above any of its axis neighbours."""
    value = total[g] - row[g]
    for k in range(neighbours.shape[1]):
        beside = neighbours[g, k]
        if total[beside] - row[beside] < value:
            return False
    return True


@njit(cache=True, error_model="numpy")
def lowest_minima(losses, neighbours, chosen):
    """Indices of the lowest local minima of the full fit on the grid.

    Args:
        losses: of fold 0, (G,).
        neighbours: of each grid point, (G, 2p).
        chosen: filled with the indices, lowest first, (K,).

    Returns:
        How many were found, at most K.
    """
    found, bar, nothing = 0, np.inf, np.zeros(losses.size)
    for g in range(losses.size):
        if losses[g] < bar and is_minimum(losses, nothing, g, neighbours):
            found = insert(losses, nothing, chosen, found, g)
            if found == chosen.size:
                bar = losses[chosen[found - 1]]
    return found


@loop
def insert(total, row, chosen, found, g):
    """Insert g into the list of the lowest total - row, kept sorted; returns its new length."""
    place, value = min(found, chosen.size - 1), total[g] - row[g]
    while place > 0 and total[chosen[place - 1]] - row[chosen[place - 1]] > value:
        chosen[place] = chosen[place - 1]
        place -= 1
    chosen[place] = g
    return min(found + 1, chosen.size)
