"""Water that turns like a solid body."""

from __future__ import annotations

from collections.abc import Sequence

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class SolidRotation:
    """Turns round ``centre`` at one rate everywhere: v = rate (-(y - c_y), x - c_x).

    Args:
        centre: c, (x, y) [length].
    """

    centre: Sequence[float] = (100.0, 50.0)

    names = ("rate",)
    units = ("rad/time",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checks.vector("centre", self.centre, 2, "length"))

    def velocity(self, theta, x, y, t):
        """(u, v) [length/time] at x, y [length]."""
        return -theta[0] * (y - self.centre[1]), theta[0] * (x - self.centre[0])

    def streamfunction(self, theta, x, y, t):
        """psi [length^2/time] at x, y [length]."""
        return 0.5 * theta[0] * ((x - self.centre[0]) ** 2 + (y - self.centre[1]) ** 2)
