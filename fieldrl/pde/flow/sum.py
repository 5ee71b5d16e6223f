"""The sum of several flows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from fieldrl.core import checks
from fieldrl.core.flow_adapter import adapted
from fieldrl.core.kinds import component
from fieldrl.pde.flow.contract import Flow


@component
class Sum:
    """All velocities added up; the parameters are those of the parts, in their order.

    Args:
        flows: the parts; their parameters must have different names.
    """

    flows: Sequence[Flow]

    in_python: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not len(self.flows):
            raise checks.InvalidValue("flows", self.flows, "must have one flow at least")
        object.__setattr__(self, "flows", tuple(adapted(flow) for flow in self.flows))
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            rule = f"must have parameters of different names; twice: {', '.join(twice)}"
            raise checks.InvalidValue("flows", list(self.names), rule)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all parts' parameters."""
        return tuple(name for flow in self.flows for name in flow.names)

    @property
    def units(self) -> tuple[str, ...]:
        """Of all parts' parameters."""
        return tuple(unit for flow in self.flows for unit in flow.units)

    @cached_property
    def _parts(self) -> list[tuple[Any, slice]]:
        """Each part and where its parameters are."""
        ends = np.cumsum([len(flow.names) for flow in self.flows]).tolist()
        starts = [0, *ends[:-1]]
        return [(flow, slice(start, end)) for flow, start, end in zip(self.flows, starts, ends, strict=True)]

    def velocity(self, theta, x, y, t):
        """(u, v) [length/time] at x, y [length]."""
        places = np.stack(np.broadcast_arrays(x, y), axis=-1).reshape(-1, 2)
        total = np.sum([flow.velocity(theta[own], places, t) for flow, own in self._parts], axis=0)
        return total[:, 0], total[:, 1]

    @property
    def streamfunction(self) -> Callable[..., Any] | None:
        """psi(theta, x, y, t) [length^2/time]; None where a part has none."""
        parts = [(getattr(flow, "streamfunction", None), own) for flow, own in self._parts]
        if any(psi is None for psi, _ in parts):
            return None

        def psi(theta, x, y, t):
            places = np.stack([x, y], axis=-1)
            return sum(one(theta[own], places, t) for one, own in parts if one is not None)

        return psi
