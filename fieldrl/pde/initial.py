"""The initial feature h(x), Eq. (26): h(x) = a exp(-|x - c|_q^q / sigma^q)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks


@dataclass(frozen=True)
class InitialFeature:
    """A feature that decays from its centre, Eq. (26).

    Args:
        amplitude: a, the value at the centre, not 0 [field unit].
        centre: c, (x, y) [length].
        scale: sigma > 0 [length].
        exponent: q >= 1, how sharply it decays.
    """

    amplitude: float = 100.0
    centre: Sequence[float] = (50.0, 50.0)
    scale: float = 40.0
    exponent: float = 2.0

    def __post_init__(self) -> None:
        if checks.number("amplitude", self.amplitude, "field unit") == 0:
            raise checks.InvalidValue("amplitude", self.amplitude, "must not be 0", "field unit")
        object.__setattr__(self, "centre", checks.vector("centre", self.centre, 2, "length"))
        checks.positive("scale", self.scale, "length")
        checks.at_least("exponent", self.exponent, 1)

    @property
    def constants(self) -> NDArray[np.float64]:
        """(a, c_x, c_y, sigma, q), for compiled code."""
        return np.array([self.amplitude, *self.centre, self.scale, self.exponent])

    def value(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """h at positions (n, 2) [length]: (n,) [field unit]."""
        distance = np.abs(np.asarray(positions) - self.centre) / self.scale
        return self.amplitude * np.exp(-np.sum(distance**self.exponent, axis=-1))
