"""Two gyres whose common wall swings.

| symbol | meaning |
|---|---|
| s = mu sin(omega t) | displacement of the wall between the two gyres |
| f = s X^2 + (1 - 2 s) X | X = x/L, Y = y/L |
"""

from __future__ import annotations

import math

import numpy as np
from numba import cfunc
from numpy.typing import ArrayLike, NDArray

from fieldrl.core import checks
from fieldrl.core.compiled import FLOW
from fieldrl.core.kinds import component
from fieldrl.pde.flow.contract import parameters, points


@cfunc(FLOW, cache=True)
def _double_gyre(theta, constants, x, y, t, velocity):
    amplitude, length = constants[0], constants[1]
    s = theta[0] * math.sin(theta[1] * t)
    x, y = x / length, math.pi * y / length
    phase = math.pi * (s * x * x + (1.0 - 2.0 * s) * x)
    speed = math.pi * amplitude * length
    velocity[0] = -speed * math.sin(phase) * math.cos(y)
    velocity[1] = speed * math.cos(phase) * math.sin(y) * (2.0 * s * (x - 1.0) + 1.0)


@component
class DoubleGyre:
    """Two counter-rotating gyres whose common wall swings, Eq. 28 in the form of Shadden et al. (2005).

    theta = (mu, omega) [1, rad/time]; psi = A L^2 sin(pi f) sin(pi Y). The gyres fill (0, 2 L) x (0, L),
    on whose walls the normal velocity is zero at all times.

    Args:
        amplitude: A > 0 [1/time].
        length: L > 0, size of one gyre [length].
    """

    amplitude: float = 0.1
    length: float = 100.0

    names = ("mu", "omega")
    units = ("1", "rad/time")

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", checks.positive("amplitude", self.amplitude, "1/time"))
        object.__setattr__(self, "length", checks.positive("length", self.length, "length"))

    @property
    def kernel(self) -> int:
        """Address of the compiled FLOW function."""
        return int(_double_gyre.address or 0)

    @property
    def constants(self) -> NDArray[np.float64]:
        """(A, L), (2,)."""
        return np.array([self.amplitude, self.length])

    def velocity(self, theta: ArrayLike, positions: ArrayLike, time: float) -> NDArray[np.float64]:
        """Velocity [length/time] at positions (n, 2) [length], (n, 2)."""
        x, y = points(positions).T / self.length
        s = self._displacement(theta, time)
        phase, speed = np.pi * (s * x + (1 - 2 * s)) * x, np.pi * self.amplitude * self.length
        u = -speed * np.sin(phase) * np.cos(np.pi * y)
        v = speed * np.cos(phase) * np.sin(np.pi * y) * (2 * s * (x - 1) + 1)
        return np.stack([u, v], axis=-1)

    def streamfunction(self, theta: ArrayLike, positions: ArrayLike, time: float) -> NDArray[np.float64]:
        """psi [length^2/time] at positions (n, 2) [length], (n,)."""
        x, y = points(positions).T / self.length
        s = self._displacement(theta, time)
        scale = self.amplitude * self.length**2
        return scale * np.sin(np.pi * (s * x + (1 - 2 * s)) * x) * np.sin(np.pi * y)

    def factors(
        self, theta: ArrayLike, x: ArrayLike, y: ArrayLike, times: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """psi as one product: factors of x (k, 1, nx) and of y (1, ny), for times (k,)."""
        x, y = np.asarray(x, dtype=float) / self.length, np.asarray(y, dtype=float) / self.length
        s = self._displacement(theta, np.asarray(times, dtype=float))[:, None]
        of_x = self.amplitude * self.length**2 * np.sin(np.pi * (s * x + (1 - 2 * s)) * x)
        return of_x[:, None, :], np.sin(np.pi * y)[None]

    @staticmethod
    def _displacement(theta: ArrayLike, time):
        """s at the time(s)."""
        mu, omega = parameters(theta, 2)
        return mu * np.sin(omega * time)
