"""From cell averages to values at points, and from a function to cell averages.

| symbol | meaning | shape | unit |
|---|---|---|---|
| c | cell averages | (nx, ny) | field |
| xi | position within a cell, from its centre, in cells; in [-1/2, 1/2] | (n,) | |
| w | weights of the WIDTH averages round a point, exact for polynomials of degree WIDTH - 1 | (n, WIDTH) | |
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

WIDTH = 9
_REACH = WIDTH // 2
_OFFSETS = np.arange(-_REACH, _REACH + 1)


def _polynomials() -> NDArray[np.float64]:
    """Coefficients P with w(xi) = P @ (1, xi, xi^2, ...), (WIDTH, WIDTH)."""
    power = np.arange(WIDTH)
    upper, lower = (_OFFSETS[:, None] + 0.5), (_OFFSETS[:, None] - 0.5)
    averages = (upper ** (power + 1) - lower ** (power + 1)) / (power + 1)
    return np.asarray(np.linalg.inv(averages).T, dtype=np.float64)


POLYNOMIALS = _polynomials()


def stencil(
    points: NDArray[np.float64], low: float, high: float, cells: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Cells round each point along one axis and their weights; walls mirror the field.

    Args:
        points: coordinates in [low, high], (n,) [length].
        low: the lower wall [length].
        high: the upper wall [length].
        cells: how many equal cells lie between them.

    Returns:
        indices (n, WIDTH) and weights (n, WIDTH).
    """
    position = (points - low) * (cells / (high - low))
    nearest = np.minimum(np.maximum(np.floor(position).astype(np.int64), 0), cells - 1)
    xi = position - nearest - 0.5
    weights = xi[:, None] ** np.arange(WIDTH) @ POLYNOMIALS.T
    indices = (nearest[:, None] + _OFFSETS) % (2 * cells)
    return np.minimum(indices, 2 * cells - 1 - indices), weights


@njit(cache=True, error_model="numpy", nogil=True)
def values(states, which, x, y, along_x, along_y, out):
    """Values at n points, in place.

    Args:
        states: cell averages, (k, nx, ny).
        which: the state that each point is in, (n,).
        x: cells round each point, (n, WIDTH, WIDTH).
        y: the same along y.
        along_x: weights of a point's columns of cells, (n, WIDTH).
        along_y: weights of its rows.
        out: the values, (n,).
    """
    for n in range(out.size):
        state, total = states[which[n]], 0.0
        for i in range(WIDTH):
            row = 0.0
            for j in range(WIDTH):
                row += along_y[n, j] * state[x[n, i, j], y[n, i, j]]
            total += along_x[n, i] * row
        out[n] = total


def matrix(points: NDArray[np.float64], low: float, high: float, cells: int) -> NDArray[np.float64]:
    """The same weights as a matrix that acts on all cells of an axis, (n, cells)."""
    indices, weights = stencil(points, low, high, cells)
    dense = np.zeros((len(points), cells))
    np.add.at(dense, (np.arange(len(points))[:, None], indices), weights)
    return dense


def cell_averages(
    value: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    nodes: int = 4,
) -> NDArray[np.float64]:
    """Averages of ``value`` over cells with edges x (nx + 1,) and y (ny + 1,), by Gauss's rule, (nx, ny)."""
    node, weight = np.polynomial.legendre.leggauss(nodes)
    along_x, along_y = (
        (0.5 * (edge[1:] + edge[:-1])[:, None] + 0.5 * np.diff(edge)[:, None] * node).ravel()
        for edge in (x, y)
    )
    points = np.stack(np.meshgrid(along_x, along_y, indexing="ij"), axis=-1).reshape(-1, 2)
    values = np.asarray(value(points), dtype=float).reshape(len(x) - 1, nodes, len(y) - 1, nodes)
    return np.einsum("iajb,a,b->ij", values, weight / 2, weight / 2)


def cells_per_rise(averages: NDArray[np.float64]) -> float:
    """Over how many cells the field rises from 0 to its largest value where it is steepest."""
    steepest = max(np.abs(np.diff(averages, axis=axis)).max() for axis in (0, 1))
    return float(np.abs(averages).max() / steepest) if steepest > 0 else np.inf
