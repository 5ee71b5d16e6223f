"""The positivity-preserving time step, for features that must not become negative anywhere.

The third-order strong-stability-preserving Runge-Kutta method (Shu & Osher, 1988) with Zalesak's (1979)
limiter on every Euler stage: the flux is first-order upwind with second-order diffusion, which keeps the
sign, plus as much of the difference to the high-order flux as leaves no cell below zero.

| symbol | meaning | lives on |
|---|---|---|
| F, A | low-order flux, high-order less low-order flux | faces (nx + 1, whole), (nx, whole) |
| R | fraction of what would leave a cell that may leave it | cells |
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, uintp
from numpy.typing import NDArray

from fieldrl.pde.finite_volumes import fluxes as fv
from fieldrl.pde.finite_volumes.stencils import VECTOR, Layout

_0, _1, _2, _3, _8 = uintp(0), uintp(1), uintp(2), uintp(3), uintp(VECTOR)
_ALMOST = 1 - 1e-12  # keeps rounding on the right side of zero


class Faces(NamedTuple):
    """Fluxes through all faces: low order, and what the high order adds; the fraction R of every cell."""

    low_x: NDArray[np.float64]
    low_y: NDArray[np.float64]
    more_x: NDArray[np.float64]
    more_y: NDArray[np.float64]
    fraction: NDArray[np.float64]


def faces(shape: Layout) -> Faces:
    """Working arrays for a layout."""
    row = shape.whole + VECTOR
    x, y = np.zeros((shape.nx + 1, row)), np.zeros((shape.nx, row))
    return Faces(x, y, x.copy(), y.copy(), np.ones((shape.nx + 2, shape.ny + 2)))


def step_rate(advection: float, diffusion: float) -> float:
    """Least number of steps per time for S and Q of ``stepping`` [1/time]: no cell loses more than it has."""
    return advection + 2 * diffusion


@njit(**fv.OPTIONS)
def _high_fluxes(c, psi_x, psi_y, shape, weights, walls, work, out):
    """The scheme's own fluxes, into out.more_x and out.more_y."""
    g, row, n = uintp(shape.ghosts), uintp(shape.row), uintp(shape.whole)
    vertices, ring, m = n + _3 + _8, n + _8, work.moment_x
    for face in range(shape.nx + 1):
        f = uintp(face)
        at = (f + g) * row + g
        for r in range(4):
            fv.moment_along(c, at + uintp(r) * row - _2 * row, _1, m, uintp(r) * ring, n)
        fv.face_flux_x(
            c, at, row, psi_x, (f + _1) * vertices, m, _0, ring, ring + ring, ring + ring + ring,
            weights.even, weights.upwind, weights.diffusion_x, weights.per_y, out.more_x[face], _0, n,
        )  # fmt: skip
        if face < shape.nx:
            fv.moment_along(c, at - _2, row, work.moment_y, _0, n + _8)
            fv.face_flux_y(
                c, at, psi_y, f * vertices + _1, vertices, work.moment_y, weights.even, weights.upwind,
                weights.diffusion_y, weights.per_x, out.more_y[face], n,
            )  # fmt: skip


@njit(**fv.OPTIONS)
def _split(c, psi_x, psi_y, shape, weights, walls, diffusivity, out):
    """Low-order fluxes into out.low_*; out.more_* becomes what the high order adds."""
    g, row, width = shape.ghosts, shape.row, shape.whole + 3 + VECTOR
    cells = c.reshape(c.size // row, row)
    along_y, along_x = psi_x.reshape(shape.nx + 3, width), psi_y.reshape(shape.nx + 3, width)
    closed = walls.cells.size > 0
    for i in range(shape.nx + 1):
        for j in range(shape.ny):
            left, right = cells[i + g - 1, j + g], cells[i + g, j + g]
            speed = (along_y[i + 1, j + 1] - along_y[i + 1, j + 2]) * weights.per_y
            low = (
                max(speed, 0.0) * left
                + min(speed, 0.0) * right
                - diffusivity * weights.per_x * (right - left)
            )
            is_open = walls.open_x[i, j] if closed else 1.0
            out.low_x[i, j] = low * is_open
            out.more_x[i, j] = (out.more_x[i, j] - low) * is_open
    for i in range(shape.nx):
        for j in range(shape.ny + 1):
            left, right = cells[i + g, j + g - 1], cells[i + g, j + g]
            speed = (along_x[i + 2, j + 1] - along_x[i + 1, j + 1]) * weights.per_x
            low = (
                max(speed, 0.0) * left
                + min(speed, 0.0) * right
                - diffusivity * weights.per_y * (right - left)
            )
            is_open = walls.open_y[i, j] if closed else 1.0
            out.low_y[i, j] = low * is_open
            out.more_y[i, j] = (out.more_y[i, j] - low) * is_open


@njit(**fv.OPTIONS)
def _low_order_update(c, step, shape, weights, f, into):
    """into = c + step * (low-order inflow), and the fraction R of every cell."""
    g, row = shape.ghosts, shape.row
    for i in range(shape.nx):
        for j in range(shape.ny):
            x = (f.low_x[i, j] - f.low_x[i + 1, j]) * weights.per_x
            y = (f.low_y[i, j] - f.low_y[i, j + 1]) * weights.per_y
            at = (i + g) * row + j + g
            into[at] = c[at] + step * (x + y)
            leaves = step * (
                (max(f.more_x[i + 1, j], 0.0) - min(f.more_x[i, j], 0.0)) * weights.per_x
                + (max(f.more_y[i, j + 1], 0.0) - min(f.more_y[i, j], 0.0)) * weights.per_y
            )
            f.fraction[i + 1, j + 1] = _ALMOST * min(1.0, max(into[at], 0.0) / leaves) if leaves > 0 else 1.0


@njit(**fv.OPTIONS)
def _limit(more, fraction, dx, dy):
    """Scale each added flux by the fraction of the cell that it leaves."""
    for i in range(fraction.shape[0] - 1 - dy):
        for j in range(fraction.shape[1] - 1 - dx):
            giver = fraction[i + dy, j + dx] if more[i, j] > 0 else fraction[i + 1, j + 1]
            more[i, j] *= giver


@njit(**fv.OPTIONS)
def _euler(c, psi_x, psi_y, rate, step, shape, weights, walls, work, diffusivity, f, into):
    """into = c + step * L c that has no cell below zero."""
    fv.fill(c, shape, walls)
    _high_fluxes(c, psi_x, psi_y, shape, weights, walls, work, f)
    _split(c, psi_x, psi_y, shape, weights, walls, diffusivity, f)
    _low_order_update(c, step, shape, weights, f, into)
    _limit(f.more_x, f.fraction, 1, 0)
    _limit(f.more_y, f.fraction, 0, 1)
    g, row = shape.ghosts, shape.row
    for i in range(shape.nx):
        for j in range(shape.ny):
            x = (f.more_x[i, j] - f.more_x[i + 1, j]) * weights.per_x
            y = (f.more_y[i, j] - f.more_y[i, j + 1]) * weights.per_y
            into[(i + g) * row + j + g] += step * (x + y)
    if rate.size > 0:
        into += step * rate


@njit(**fv.OPTIONS)
def advance(c, psi_x, psi_y, rates, step, shape, weights, walls, work, diffusivity, f, spare):
    """Carry the cells c over one step for every three levels (t, t + step, t + step / 2), in place."""
    one, two = spare[0], spare[1]
    given = shape, weights, walls, work, diffusivity, f
    for level in range(0, psi_x.shape[0], 3):
        now, end, middle = level, level + 1, level + 2
        _euler(c, psi_x[now], psi_y[now], rates[now], step, *given, one)
        _euler(one, psi_x[end], psi_y[end], rates[end], step, *given, two)
        one[:] = 0.75 * c + 0.25 * two
        _euler(one, psi_x[middle], psi_y[middle], rates[middle], step, *given, two)
        c[:] = c / 3 + 2 / 3 * two
