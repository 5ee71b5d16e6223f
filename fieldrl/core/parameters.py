"""The unknowns of a forward model: their names, units, bounds and, in a simulation, true values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Parameters:
    """p named unknowns.

    Args:
        names: (p,).
        units: (p,).
        lower: lower bounds, (p,) [each its unit].
        upper: upper bounds, (p,) [each its unit].
        true: the values that generated the field, (p,); NaN where nobody knows them (all, if empty).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    true: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.true is None or not len(self.true):
            object.__setattr__(self, "true", (math.nan,) * len(self.names))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def truth_known(self) -> bool:
        """Whether every true value is known."""
        return all(math.isfinite(value) for value in self.true)

    @cached_property
    def centre(self) -> NDArray[np.float64]:
        """theta0, the centre of the bounds, (p,)."""
        return (np.asarray(self.lower) + np.asarray(self.upper)) / 2

    @cached_property
    def half_width(self) -> NDArray[np.float64]:
        """s, half the distance between the bounds, (p,)."""
        return (np.asarray(self.upper) - np.asarray(self.lower)) / 2

    def distance(self, theta: NDArray, true: ArrayLike | None = None) -> NDArray[np.float64]:
        """How far theta (..., p) is from the truth, (...); NaN where that is unknown.

        ``true``, (..., p), stands for a truth of its own, where episodes differ in it.

        |theta - true| in their unit, where they have one in common; otherwise each difference counts in
        half-widths of its bounds [1].
        """
        difference = np.asarray(theta) - np.asarray(self.true if true is None else true)
        return np.linalg.norm(difference if self.one_unit else difference / self.half_width, axis=-1)

    @property
    def one_unit(self) -> bool:
        """Whether all have the same unit."""
        return len(set(self.units)) <= 1


def known(true: Iterable[float | None]) -> tuple[float, ...]:
    """True values with NaN for those that are None."""
    return tuple(math.nan if value is None else value for value in true)
