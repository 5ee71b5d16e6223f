"""Weights, sizes and working arrays of the finite-volume scheme.

| symbol | meaning | shape |
|---|---|---|
| K | cells on either side of a face that a stencil uses, (order + 1) / 2 | |
| padded cells | rows along y with K ghosts on every side, filled up to whole vectors, flat | (size,) |
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

VECTOR = 8  # numbers in the widest vector register

EVEN = {
    3: (7 / 12, -1 / 12),
    5: (37 / 60, -2 / 15, 1 / 60),
    7: (533 / 840, -139 / 840, 29 / 840, -1 / 280),
    9: (1627 / 2520, -473 / 2520, 127 / 2520, -23 / 2520, 1 / 1260),
}
UPWIND = {
    3: (1 / 4, -1 / 12),
    5: (1 / 6, -1 / 12, 1 / 60),
    7: (1 / 8, -3 / 40, 1 / 40, -1 / 280),
    9: (1 / 10, -1 / 15, 1 / 35, -1 / 140, 1 / 1260),
}
GRADIENT = {
    3: (5 / 4, -1 / 12),
    5: (49 / 36, -5 / 36, 1 / 90),
    7: (205 / 144, -127 / 720, 17 / 720, -1 / 560),
    9: (5269 / 3600, -731 / 3600, 883 / 25200, -13 / 2800, 1 / 3150),
}


class Stencils(NamedTuple):
    """Weights of the cells on either side of a face, nearest first, (K,) each, and 1 / cell size.

    Args:
        even: of the sum of a pair, for the value C.
        upwind: of its difference, for the dissipation D.
        diffusion_x: of its difference, for rho G through faces normal to x [length/time].
        diffusion_y: the same for faces normal to y [length/time].
        per_x: 1 / cell size in x [1/length].
        per_y: 1 / cell size in y [1/length].
    """

    even: tuple[float, ...]
    upwind: tuple[float, ...]
    diffusion_x: tuple[float, ...]
    diffusion_y: tuple[float, ...]
    per_x: float
    per_y: float


class Walls(NamedTuple):
    """Obstacles as the stencils see them; every array is empty where there are none.

    Args:
        cells: flat indices of the padded cells that are solid, (s,).
        nearest: the water cell from which each takes its value, (s,).
        open_x: 1 where water can pass a face normal to x, else 0, (nx + 1, padded ny).
        open_y: the same for faces normal to y, (nx, padded ny + 1).
    """

    cells: NDArray[np.int64]
    nearest: NDArray[np.int64]
    open_x: NDArray[np.float64]
    open_y: NDArray[np.float64]


class Layout(NamedTuple):
    """Sizes of a padded array of cells.

    Args:
        nx, ny: cells.
        ghosts: K, ghost cells on each side.
        row: numbers from one row along y to the next.
        whole: ny rounded up to whole vectors.
    """

    nx: int
    ny: int
    ghosts: int
    row: int
    whole: int


class Scratch(NamedTuple):
    """Rows that are worked on; made once per solve."""

    flux_x: NDArray[np.float64]
    flux_y: NDArray[np.float64]
    moment_x: NDArray[np.float64]
    moment_y: NDArray[np.float64]


def stencils(order: int, diffusivity: float, cell: tuple[float, float]) -> Stencils:
    """The weights for an order (3, 5, 7, 9), rho [length^2/time] and the cell size (x, y) [length]."""
    along_x, along_y = (tuple(w * diffusivity / h for w in GRADIENT[order]) for h in cell)
    return Stencils(EVEN[order], UPWIND[order], along_x, along_y, 1 / cell[0], 1 / cell[1])


def layout(order: int, nx: int, ny: int) -> Layout:
    """The padded array for nx times ny cells."""
    ghosts = (order + 1) // 2
    whole = -(-(ny + 1) // VECTOR) * VECTOR
    return Layout(nx, ny, ghosts, 2 * ghosts + whole + VECTOR, whole)


def scratch(shape: Layout) -> Scratch:
    """Working rows for a layout."""
    row = shape.whole + VECTOR
    return Scratch(np.zeros(2 * row), np.zeros(row), np.zeros(4 * row), np.zeros(row + VECTOR))


def padded(averages: NDArray[np.float64], shape: Layout) -> NDArray[np.float64]:
    """Cell averages (nx, ny) as a flat padded array, ghosts zero."""
    cells = np.zeros((shape.nx + 2 * shape.ghosts + 1, shape.row))
    cells[shape.ghosts : shape.ghosts + shape.nx, shape.ghosts : shape.ghosts + shape.ny] = averages
    return cells.ravel()


def interior(cells: NDArray[np.float64], shape: Layout) -> NDArray[np.float64]:
    """The cell averages (nx, ny) in a flat padded array, a view."""
    grid = cells.reshape(-1, shape.row)
    return grid[shape.ghosts : shape.ghosts + shape.nx, shape.ghosts : shape.ghosts + shape.ny]
