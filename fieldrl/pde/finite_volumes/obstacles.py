"""Obstacles on the solver's grid: which cells are solid, and how the water goes round them.

A flow component knows no obstacles. Its streamfunction psi is made constant on each obstacle by taking away
the discrete-harmonic function w that equals psi - constant on the obstacle and 0 on the outer walls: the
least potential flow that lets no water through. The constant is the mean of psi on the obstacle's edge, or
the wall's value where the obstacle touches a wall.

| symbol | meaning | shape | unit |
|---|---|---|---|
| solid | cells whose centre lies in an obstacle | (nx, ny) | |
| label | which obstacle a vertex touches, 0 for none | (nx + 1, ny + 1) | |
| psi, w | streamfunction and its correction | (k, nx + 1, ny + 1) | length^2/time |
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import linalg

from fieldrl.core import checks
from fieldrl.core.domain import Domain
from fieldrl.pde.finite_volumes.stencils import Layout, Walls


def solid_cells(domain: Domain, nx: int, ny: int) -> NDArray[np.bool_]:
    """Which cells are obstacle, (nx, ny); raises InvalidValue where no water is left."""
    solid = ~domain.contains(domain.grid(nx, ny).points).reshape(nx, ny)
    if solid.all():
        raise checks.InvalidValue("domain.obstacles", domain.obstacles, "must leave some water")
    return solid


def nearest_water(solid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """For each cell the water cell nearest to it, itself where it is water, (2, nx, ny)."""
    if not solid.any():
        return np.indices(solid.shape)
    nearest = ndimage.distance_transform_edt(solid, return_distances=False, return_indices=True)
    return np.asarray(nearest, dtype=np.int64)


def walls(solid: NDArray[np.bool_], shape: Layout) -> Walls:
    """The solid cells as the stencils see them."""
    if not solid.any():
        none, no_face = np.empty(0, dtype=np.int64), np.empty((0, 0))
        return Walls(none, none, no_face, no_face)
    where, (near_x, near_y) = np.nonzero(solid), nearest_water(solid)[:, solid]
    cells = (where[0] + shape.ghosts) * shape.row + where[1] + shape.ghosts
    nearest = (near_x + shape.ghosts) * shape.row + near_y + shape.ghosts
    water = np.pad(~solid, 1, mode="edge")
    open_x, open_y = np.zeros((shape.nx + 1, shape.whole)), np.zeros((shape.nx, shape.whole))
    open_x[:, : shape.ny] = water[:-1, 1:-1] & water[1:, 1:-1]
    open_y[:, : shape.ny + 1] = water[1:-1, :-1] & water[1:-1, 1:]
    return Walls(cells, nearest, open_x, open_y)


@dataclass(frozen=True, eq=False)
class Deflection:
    """Takes psi round the solid cells.

    Args:
        solid: (nx, ny).
        cell: cell size (x, y) [length].
    """

    solid: NDArray[np.bool_]
    cell: tuple[float, float]

    @cached_property
    def label(self) -> NDArray[np.int64]:
        """Which obstacle each vertex touches, 0 for none."""
        labelled: Any = ndimage.label(self.solid, structure=np.ones((3, 3)))
        cells = np.pad(labelled[0], 1)
        return np.maximum.reduce([cells[:-1, :-1], cells[1:, :-1], cells[:-1, 1:], cells[1:, 1:]])

    @cached_property
    def outer(self) -> NDArray[np.bool_]:
        """Vertices on the outer walls."""
        return np.pad(np.zeros(np.subtract(self.label.shape, 2), dtype=bool), 1, constant_values=True)

    @cached_property
    def _free(self) -> NDArray[np.bool_]:
        return (~self.outer & (self.label == 0)).ravel()

    @cached_property
    def _laplacian(self) -> sparse.csr_matrix:
        """Five-point Laplacian of the vertices, (v, v)."""
        along = [
            sparse.diags_array([1.0, -2.0, 1.0], offsets=[-1, 0, 1], shape=(n, n)) / h**2  # type: ignore[arg-type]
            for n, h in zip(self.label.shape, self.cell, strict=True)
        ]
        return sparse.csr_matrix(sparse.kronsum(along[1], along[0]))

    @cached_property
    def _solver(self) -> linalg.SuperLU:
        return linalg.splu(sparse.csc_matrix(self._laplacian[self._free][:, self._free]))

    def __call__(self, psi: NDArray[np.float64]) -> NDArray[np.float64]:
        """psi (k, nx + 1, ny + 1) that is constant on every obstacle and unchanged on the outer walls."""
        fixed = psi.copy()
        for obstacle in range(1, self.label.max() + 1):
            on = self.label == obstacle
            edge = on & self.outer if (on & self.outer).any() else on
            fixed[:, on] = psi[:, edge].mean(axis=1)[:, None]
        correction = np.where(self._free, 0.0, (psi - fixed).reshape(len(psi), -1))
        if self._free.any():
            driven = self._laplacian[self._free] @ correction.T
            correction[:, self._free] = -self._solver.solve(np.ascontiguousarray(driven)).T
        bent = psi - correction.reshape(psi.shape)
        bent[:, self.label > 0] = fixed[:, self.label > 0]
        return bent
