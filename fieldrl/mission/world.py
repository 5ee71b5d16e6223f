"""A plain model in a mission: what it does not say itself, a still and boundless water says for it.

| member | where the model has none |
|---|---|
| domain | the square of side 200 |
| flow | still water; an ordinary class will do, see docs/flows.md |
| horizon | none, infinite |
| admissible | every position |
| grid | about 100 cells along the domain's longer side |
| field | by predictions at the grid's points; where it says ``field = None``, there is none: NaN |
| truth | the model itself |
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.domain import Domain, Grid
from fieldrl.core.parameters import Parameters
from fieldrl.estimator.problem import Compiled, Differentiable
from fieldrl.mission.environment import Water

_CELLS = 100
_MEMBERS = ("domain", "flow", "horizon", "admissible", "field", "truth")


class Model(Protocol):
    """The least that a model has: its unknowns, and predictions."""

    @property
    def parameters(self) -> Parameters: ...

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """theta (m, p), positions (n, 2), times (n,) -> (m, n); raises SolveFailed."""
        ...


class StillWater:
    """A flow that does not move."""

    names, units = (), ()

    def velocity(self, theta, x, y, t):
        """(0, 0)."""
        return 0.0 * x, 0.0 * y


_STILL = StillWater()


def world(model: Any) -> Water:
    """The model as a mission needs it; itself, where it says everything."""
    if all(getattr(model, name, None) is not None for name in _MEMBERS):
        return model
    if not isinstance(model, Differentiable):
        return cast("Water", World(model))
    return cast("Water", (SlopedCompiled if isinstance(model, Compiled) else Sloped)(model))


@dataclass(frozen=True, eq=False)
class World:
    """A model with what it lacks.

    Args:
        model: the model.
    """

    model: Any

    @property
    def parameters(self) -> Parameters:
        """The model's."""
        return self.model.parameters

    @cached_property
    def domain(self) -> Domain:
        """Where the vehicle may go."""
        return getattr(self.model, "domain", None) or Domain()

    @property
    def flow(self) -> Any:
        """What carries the vehicle."""
        return getattr(self.model, "flow", None) or _STILL

    @property
    def horizon(self) -> float:
        """The last time that it can predict [time]."""
        return getattr(self.model, "horizon", math.inf)

    @cached_property
    def grid(self) -> Grid:
        """Where the field is recorded."""
        return getattr(self.model, "grid", None) or even_grid(self.domain)

    @property
    def has_field(self) -> bool:
        """Whether there is a field to be seen."""
        return getattr(self.model, "field", self) is not None

    def flow_parameters(self, theta: NDArray) -> NDArray[np.float64]:
        """The flow's at theta (p,): the first of theta, where the model does not tell others."""
        own = getattr(self.model, "flow_parameters", None)
        return np.asarray(theta, dtype=float) if own is None else own(theta)

    def admissible(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The nearest positions that it can predict at, (n, 2) -> (n, 2) [length]."""
        own = getattr(self.model, "admissible", None)
        return positions if own is None else own(positions)

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """The model's, (m, n)."""
        return self.model.predict(theta, positions, times)

    def field(self, theta: NDArray, time: float, grid: Grid) -> NDArray[np.float64]:
        """The field on ``grid``, (nx, ny) [field unit]."""
        return field_of(self.model, theta, time, grid)

    def truth(self) -> Water:
        """The model that generates the true field."""
        own = getattr(self.model, "truth", None)
        return cast("Water", self) if own is None else world(own())


@dataclass(frozen=True, eq=False)
class Sloped(World):
    """The same of a model that knows its derivatives."""

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """The model's, (m, n, p)."""
        return self.model.jacobian(theta, positions, times)


@dataclass(frozen=True, eq=False)
class SlopedCompiled(Sloped):
    """The same of a model that hands over a compiled function as well."""

    @property
    def kernel(self) -> int:
        """The model's."""
        return self.model.kernel

    @property
    def constants(self) -> NDArray[np.float64]:
        """The model's."""
        return self.model.constants


def field_of(model: Any, theta: NDArray, time: float, grid: Grid) -> NDArray[np.float64]:
    """A model's field on ``grid``: as it gives it, else by predictions; NaN where it says it has none."""
    if hasattr(model, "field"):
        if model.field is None:
            return np.full((grid.x.size, grid.y.size), np.nan)
        return model.field(theta, time, grid)
    points = grid.points
    values = model.predict(np.asarray(theta)[None], points, np.full(len(points), float(time)))[0]
    return np.reshape(values, (grid.x.size, grid.y.size))


def even_grid(domain: Domain) -> Grid:
    """About a hundred square cells along the longer side of a domain."""
    size = np.subtract(domain.upper, domain.lower)
    nx, ny = np.maximum(1, np.round(_CELLS * size / size.max())).astype(int)
    return domain.grid(int(nx), int(ny))
