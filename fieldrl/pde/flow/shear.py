"""Water that flows along x, faster the greater y."""

from __future__ import annotations

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class Shear:
    """A parallel flow with a constant gradient: v = (speed + shear (y - level), 0).

    Args:
        level: where the velocity is ``speed`` [length].
    """

    level: float = 50.0

    names = ("speed", "shear")
    units = ("length/time", "1/time")

    def __post_init__(self) -> None:
        object.__setattr__(self, "level", checks.number("level", self.level, "length"))

    def velocity(self, theta, x, y, t):
        """(u, v) [length/time] at x, y [length]."""
        return theta[0] + theta[1] * (y - self.level) + 0.0 * x, 0.0 * x

    def streamfunction(self, theta, x, y, t):
        """psi [length^2/time] at x, y [length]."""
        above = y - self.level
        return -(theta[0] + 0.5 * theta[1] * above) * above + 0.0 * x
