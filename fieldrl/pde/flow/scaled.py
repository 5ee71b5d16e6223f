"""A flow times a factor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from fieldrl.core import checks
from fieldrl.core.flow_adapter import adapted
from fieldrl.core.kinds import component
from fieldrl.pde.flow.contract import Flow


@component
class Scaled:
    """factor * v: the parameters are those of the flow, then the factor.

    Args:
        flow: what is scaled.
        name: of the factor.
    """

    flow: Flow
    name: str = "factor"

    in_python: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "flow", adapted(self.flow))
        if self.name in self.flow.names:
            raise checks.InvalidValue("name", self.name, "is a parameter of the flow that is scaled")

    @property
    def names(self) -> tuple[str, ...]:
        """The flow's, then the factor's."""
        return (*self.flow.names, self.name)

    @property
    def units(self) -> tuple[str, ...]:
        """The flow's, then the factor's."""
        return (*self.flow.units, "1")

    def velocity(self, theta, x, y, t):
        """(u, v) [length/time] at x, y [length]."""
        places = np.stack(np.broadcast_arrays(x, y), axis=-1).reshape(-1, 2)
        found = theta[-1] * self.flow.velocity(theta[:-1], places, t)
        return found[:, 0], found[:, 1]

    @property
    def streamfunction(self) -> Callable[..., Any] | None:
        """psi(theta, x, y, t) [length^2/time]; None where the flow has none."""
        own = getattr(self.flow, "streamfunction", None)
        if own is None:
            return None
        return lambda theta, x, y, t: theta[-1] * own(theta[:-1], np.stack([x, y], axis=-1), t)
