"""Gaussian vortices, any number of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class Vortices:
    """Vortices whose streamfunctions are Gaussians: psi = sum over k of strength_k exp(-|x - c_k|^2 / r_k^2).

    A positive strength turns clockwise; the greatest velocity, 0.86 strength / r, is 0.71 r from the centre.
    The strengths are the parameters, ``strength_1``, ``strength_2``, ...

    Args:
        centres: c, [[x, y], ...] [length].
        radii: r > 0, one for each [length].
    """

    centres: Sequence[Sequence[float]] = ((60.0, 50.0), (140.0, 50.0))
    radii: Sequence[float] = (30.0, 30.0)

    def __post_init__(self) -> None:
        if not len(self.centres):
            raise checks.InvalidValue("centres", self.centres, "must have one vortex at least")
        centres = tuple(checks.vector(f"centres.{k}", c, 2, "length") for k, c in enumerate(self.centres))
        object.__setattr__(self, "centres", centres)
        radii = checks.vector("radii", self.radii, len(centres), "length")
        object.__setattr__(self, "radii", tuple(checks.positive("radii", r, "length") for r in radii))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the strengths."""
        return tuple(f"strength_{k + 1}" for k in range(len(self.centres)))

    @property
    def units(self) -> tuple[str, ...]:
        """Of the strengths."""
        return ("length^2/time",) * len(self.centres)

    def velocity(self, theta, x, y, t):
        """(u, v) [length/time] at x, y [length]."""
        u, v = 0.0 * x, 0.0 * y
        for k in range(len(self.radii)):
            dx, dy, r2 = x - self.centres[k][0], y - self.centres[k][1], self.radii[k] ** 2
            slope = 2.0 * theta[k] / r2 * np.exp(-(dx * dx + dy * dy) / r2)
            u, v = u + slope * dy, v - slope * dx
        return u, v

    def streamfunction(self, theta, x, y, t):
        """psi [length^2/time] at x, y [length]."""
        psi = 0.0 * x
        for k in range(len(self.radii)):
            dx, dy = x - self.centres[k][0], y - self.centres[k][1]
            psi = psi + theta[k] * np.exp(-(dx * dx + dy * dy) / self.radii[k] ** 2)
        return psi
