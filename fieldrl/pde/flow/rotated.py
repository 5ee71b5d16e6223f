"""A flow, turned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np

from fieldrl.core import checks
from fieldrl.core.flow_adapter import adapted
from fieldrl.core.kinds import component
from fieldrl.pde.flow.contract import Flow


@component
class Rotated:
    """The whole pattern turned counter-clockwise: R v(R^-1 (x - c) + c).

    The parameters are those of the flow, then the angle.

    Args:
        flow: what is turned.
        centre: c, about which, (x, y) [length].
        name: of the angle.
    """

    flow: Flow
    centre: Sequence[float] = (100.0, 50.0)
    name: str = "angle"

    in_python: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "flow", adapted(self.flow))
        object.__setattr__(self, "centre", checks.vector("centre", self.centre, 2, "length"))
        if self.name in self.flow.names:
            raise checks.InvalidValue("name", self.name, "is a parameter of the flow that is turned")

    @property
    def names(self) -> tuple[str, ...]:
        """The flow's, then the angle's."""
        return (*self.flow.names, self.name)

    @property
    def units(self) -> tuple[str, ...]:
        """The flow's, then the angle's."""
        return (*self.flow.units, "rad")

    def _before(self, theta, x, y):
        """Where the places (n, 2) were before the turn, and the turn (2, 2)."""
        cos, sin = np.cos(theta[-1]), np.sin(theta[-1])
        turn = np.array([[cos, -sin], [sin, cos]])
        places = np.stack(np.broadcast_arrays(x, y), axis=-1).reshape(-1, 2)
        return (places - self.centre) @ turn + self.centre, turn

    def velocity(self, theta, x, y, t):
        """(u, v) [length/time] at x, y [length]."""
        before, turn = self._before(theta, x, y)
        found = self.flow.velocity(theta[:-1], before, t) @ turn.T
        return found[:, 0], found[:, 1]

    @property
    def streamfunction(self) -> Callable[..., Any] | None:
        """psi(theta, x, y, t) [length^2/time]; None where the flow has none."""
        own = getattr(self.flow, "streamfunction", None)
        if own is None:
            return None
        return lambda theta, x, y, t: own(theta[:-1], self._before(theta, x, y)[0], t)
