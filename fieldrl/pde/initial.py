"""The initial feature h(x), Eq. (26): h(x) = a exp(-|x - c|_q^q / sigma^q)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component


class Feature(Protocol):
    """What the water holds at time 0: value(positions (n, 2)) -> (n,) [field unit]."""

    def value(self, positions: NDArray[np.float64]) -> NDArray[np.float64]: ...


def check_visible(initial: Any, source: Any, unknown: Collection[str]) -> None:
    """Raises InvalidValue where nothing is ever in the water: the feature is 0 and there is no source."""
    if getattr(initial, "amplitude", 1.0) == 0 and source is None and "amplitude" not in unknown:
        rule = "must not be 0 where there is no source: the water would be empty"
        raise checks.InvalidValue("initial.amplitude", initial.amplitude, rule, "field unit")


@component
class InitialFeature:
    """A feature that decays from its centre, Eq. (26).

    Args:
        amplitude: a, the value at the centre [field unit].
        centre: c, (x, y) [length].
        scale: sigma > 0 [length].
        exponent: q >= 1, how sharply it decays.
    """

    amplitude: float = 100.0
    centre: Sequence[float] = (50.0, 50.0)
    scale: float = 40.0
    exponent: float = 2.0

    scalars: ClassVar[dict[str, tuple[str, int | None, str]]] = {
        "amplitude": ("amplitude", None, "field unit"),
        "centre_x": ("centre", 0, "length"),
        "centre_y": ("centre", 1, "length"),
        "scale": ("scale", None, "length"),
        "exponent": ("exponent", None, "1"),
    }

    def __post_init__(self) -> None:
        checks.number("amplitude", self.amplitude, "field unit")
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
