"""The unknowns of a forward model: their names, units, bounds and, in a simulation, true values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Parameters:
    """p named unknowns.

    Args:
        names: (p,).
        units: (p,).
        lower: lower bounds, (p,) [each its unit].
        upper: upper bounds, (p,) [each its unit].
        true: the values that generated the field, (p,), or None where nobody knows them.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    true: tuple[float, ...] | None = None

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def centre(self) -> NDArray[np.float64]:
        """theta0, the centre of the bounds, (p,)."""
        return (np.asarray(self.lower) + np.asarray(self.upper)) / 2

    @cached_property
    def half_width(self) -> NDArray[np.float64]:
        """s, half the distance between the bounds, (p,)."""
        return (np.asarray(self.upper) - np.asarray(self.lower)) / 2
