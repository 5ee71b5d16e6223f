"""Cellular flow: a chessboard of vortices that turn against each other (Taylor & Green, 1937)."""

from __future__ import annotations

import numpy as np

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class TaylorGreen:
    """Square cells that turn against each other and slow down.

    psi = (speed L / pi) exp(-decay t) sin(pi x / L) sin(pi y / L); ``speed`` is the greatest velocity at
    t = 0. No water crosses the lines x = k L, y = k L.

    Args:
        length: L > 0, side of a cell [length].
    """

    length: float = 50.0

    names = ("speed", "decay")
    units = ("length/time", "1/time")

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", checks.positive("length", self.length, "length"))

    def velocity(self, theta, x, y, t):
        """(u, v) [length/time] at x, y [length]."""
        speed, kx, ky = theta[0] * np.exp(-theta[1] * t), np.pi * x / self.length, np.pi * y / self.length
        return -speed * np.sin(kx) * np.cos(ky), speed * np.cos(kx) * np.sin(ky)

    def streamfunction(self, theta, x, y, t):
        """psi [length^2/time] at x, y [length]."""
        scale = theta[0] * np.exp(-theta[1] * t) * self.length / np.pi
        return scale * np.sin(np.pi * x / self.length) * np.sin(np.pi * y / self.length)
