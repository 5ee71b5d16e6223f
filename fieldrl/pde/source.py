"""The source term g(x, t) of Eq. (1): where the feature enters (g > 0) or leaves (g < 0) the water."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class LocalisedSource:
    """A source (or sink) round one place: g = rate exp(-|x - c|^2 / width^2) while it is open.

    Args:
        strength: the rate at the centre; negative for a sink [field unit/time].
        centre: c, (x, y) [length].
        width: > 0 [length].
        opens: time at which it starts [time].
        closes: time at which it stops, after ``opens``; null for never [time].
    """

    strength: float
    centre: Sequence[float]
    width: float
    opens: float = 0.0
    closes: float | None = None

    scalars: ClassVar[dict[str, tuple[str, int | None, str]]] = {
        "source_strength": ("strength", None, "field unit/time"),
        "source_x": ("centre", 0, "length"),
        "source_y": ("centre", 1, "length"),
        "source_width": ("width", None, "length"),
        "source_opens": ("opens", None, "time"),
        "source_closes": ("closes", None, "time"),
    }

    def __post_init__(self) -> None:
        checks.number("strength", self.strength, "field unit/time")
        object.__setattr__(self, "centre", checks.vector("centre", self.centre, 2, "length"))
        checks.positive("width", self.width, "length")
        checks.not_negative("opens", self.opens, "time")
        if self.closes is not None and checks.number("closes", self.closes, "time") <= self.opens:
            raise checks.InvalidValue("closes", self.closes, f"must be after opens={self.opens:g}", "time")

    @property
    def constants(self) -> NDArray[np.float64]:
        """(strength, c_x, c_y, width, opens, closes), for compiled code."""
        closes = np.inf if self.closes is None else self.closes
        return np.array([self.strength, *self.centre, self.width, self.opens, closes])

    def rate(self, positions: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """g at positions (n, 2) [length] and one time: (n,) [field unit/time]."""
        strength, *_, width, opens, closes = self.constants
        distance = (np.asarray(positions) - self.centre) / width
        return strength * (opens <= time < closes) * np.exp(-np.sum(distance**2, axis=-1))
