"""The same velocity everywhere and always."""

from __future__ import annotations

import numpy as np
from numba import cfunc
from numpy.typing import ArrayLike, NDArray

from fieldrl.core.compiled import FLOW
from fieldrl.core.kinds import component
from fieldrl.pde.flow.contract import parameters, points


@cfunc(FLOW, cache=True)
def _uniform(theta, constants, x, y, t, velocity):
    velocity[0] = theta[0]
    velocity[1] = theta[1]


@component
class UniformFlow:
    """The same velocity b everywhere and always, Eq. 1; theta = (b_x, b_y) [length/time]."""

    names = ("b_x", "b_y")
    units = ("length/time", "length/time")

    @property
    def kernel(self) -> int:
        """Address of the compiled FLOW function."""
        return int(_uniform.address or 0)

    @property
    def constants(self) -> NDArray[np.float64]:
        """None, (0,)."""
        return np.empty(0)

    def velocity(self, theta: ArrayLike, positions: ArrayLike, time: float) -> NDArray[np.float64]:
        """Velocity [length/time] at positions (n, 2) [length], (n, 2)."""
        return np.tile(parameters(theta, 2), (len(points(positions)), 1))

    def streamfunction(self, theta: ArrayLike, positions: ArrayLike, time: float) -> NDArray[np.float64]:
        """psi = b_y x - b_x y [length^2/time] at positions (n, 2) [length], (n,)."""
        b_x, b_y = parameters(theta, 2)
        x, y = points(positions).T
        return b_y * x - b_x * y

    def factors(
        self, theta: ArrayLike, x: ArrayLike, y: ArrayLike, times: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """psi as two products: factors of x (k, 2, nx) and of y (2, ny), for times (k,)."""
        b_x, b_y = parameters(theta, 2)
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        of_x = np.stack([b_y * x, np.full_like(x, -b_x)])
        return np.repeat(of_x[None], np.size(times), axis=0), np.stack([np.ones_like(y), y])
