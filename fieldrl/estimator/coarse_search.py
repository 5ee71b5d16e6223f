"""A coarse grid over the box of the bounds, on which squared residuals are kept per sample.

A fold's loss on the grid is the total of all samples less one row, so a new sample costs one new row
and every fold's starting points follow from sums. The rows are a memo: each is labelled with its
sample, computed again where the label differs, and changes no result.

| symbol | meaning | shape |
|---|---|---|
| u | grid points, scaled unknowns | (G, p) |
| squared | squared residuals of each sample | (capacity, G) |
| labels | the sample (x, y, t, value) of each row | (capacity, 4) |
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.core.compiled import call_model


def box_grid(points: int, p: int) -> NDArray[np.float64]:
    """The regular grid of ``points`` ** ``p`` cell centres of the box |u| <= 1, (G, p), last fastest."""
    axis = (np.arange(points) + 0.5) * (2.0 / points) - 1.0
    return np.stack(np.meshgrid(*[axis] * p, indexing="ij"), axis=-1).reshape(-1, p)


@njit(cache=True)
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


@njit(cache=True)
def refresh(kernel, constants, theta, positions, times, values, labels, squared):
    """Bring the memo's first n rows up to date with the samples; returns how many were computed."""
    computed = 0
    for j in range(times.size):
        if (
            labels[j, 0] != positions[j, 0]
            or labels[j, 1] != positions[j, 1]
            or labels[j, 2] != times[j]
            or labels[j, 3] != values[j]
        ):
            squared_residuals(kernel, constants, theta, positions[j], times[j : j + 1], values[j], squared[j])
            labels[j, 0], labels[j, 1] = positions[j]
            labels[j, 2], labels[j, 3] = times[j], values[j]
            computed += 1
    return computed


@njit(cache=True)
def totals(squared, n, total, largest):
    """Sum and largest of the first n rows at every grid point, written in place, (G,)."""
    total[:] = 0.0
    largest[:] = 0.0
    for j in range(n):
        row = squared[j]
        for g in range(total.size):
            total[g] += row[g]
            largest[g] = max(largest[g], row[g])


@njit(cache=True)
def is_minimum(losses, g, points, p):
    """Whether grid point g is not above any of its 2p axis neighbours."""
    stride, value = 1, losses[g]
    for _ in range(p):
        place = (g // stride) % points
        if place > 0 and losses[g - stride] < value:
            return False
        if place < points - 1 and losses[g + stride] < value:
            return False
        stride *= points
    return True


@njit(cache=True)
def lowest_minima(losses, points, p, chosen):
    """Indices of the lowest local minima on the grid.

    Args:
        losses: on the grid, (G,).
        points: grid points along each dimension.
        p: dimensions.
        chosen: filled with the indices, lowest first, (K,).

    Returns:
        How many were found, at most K.
    """
    found, bar = 0, np.inf
    for g in range(losses.size):
        if losses[g] < bar and is_minimum(losses, g, points, p):
            found = insert(losses, chosen, found, g)
            if found == chosen.size:
                bar = losses[chosen[found - 1]]
    return found


@njit(cache=True)
def insert(losses, chosen, found, g):
    """Insert g into the list of the lowest, kept sorted; returns its new length."""
    place = min(found, chosen.size - 1)
    while place > 0 and losses[chosen[place - 1]] > losses[g]:
        chosen[place] = chosen[place - 1]
        place -= 1
    chosen[place] = g
    return min(found + 1, chosen.size)
