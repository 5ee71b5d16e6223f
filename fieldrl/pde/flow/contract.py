"""What a flow is: how the water moves, with parameters that may be unknown.

| symbol | meaning | shape | unit |
|---|---|---|---|
| theta | parameters of the flow | (p,) | each its own |
| v = (u, v) | velocity | (n, 2) | length/time |
| psi | streamfunction, v = (-dpsi/dy, dpsi/dx) | (n,) | length^2/time |

An **ordinary flow** is any class with ``names``, ``units`` and ``velocity(theta, x, y, t) -> (u, v)``;
nothing else is required. ``core/flow_adapter.adapted`` makes it what solver and vehicle work with.
``streamfunction(theta, x, y, t) -> psi`` is welcome: with it the water is free of divergence to rounding and
can be led round obstacles.

A flow of this package may also have ``factors``: its streamfunction as a short sum of products of a function
of (x, t) and a function of y. The solver then needs no transcendental functions inside its time loop.
"""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fieldrl.core.flow_adapter import parameters, points

__all__ = ["Flow", "Separable", "parameters", "points"]


class Flow(Protocol):
    """Any flow. ``names`` and ``units`` are those of its parameters, (p,)."""

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def units(self) -> tuple[str, ...]: ...

    @property
    def velocity(self) -> Any: ...


@runtime_checkable
class Separable(Protocol):
    """A flow with psi(x, y, t) = sum over r of X_r(x, t) Y_r(y)."""

    def factors(
        self, theta: ArrayLike, x: ArrayLike, y: ArrayLike, times: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
