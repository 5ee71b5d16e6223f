"""The water: a rectangle less obstacles (the set S of section 3.3), and regular grids on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import OR_NULL, component


@component
class Rectangle:
    """A closed axis-parallel rectangle [length].

    Args:
        lower: its least corner (x, y).
        upper: its greatest corner (x, y).
    """

    lower: Sequence[float]
    upper: Sequence[float]

    def __post_init__(self) -> None:
        _corners(self)

    def contains(self, positions: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the positions (n, 2) lie in the open rectangle, (n,)."""
        return np.all((positions > self.lower) & (positions < self.upper), axis=-1)


@component
class Circle:
    """A closed disc [length].

    Args:
        centre: (x, y).
        radius: > 0.
    """

    centre: Sequence[float]
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", checks.vector("centre", self.centre, 2, "length"))
        checks.positive("radius", self.radius, "length")

    def contains(self, positions: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the positions (n, 2) lie in the open disc, (n,)."""
        return np.hypot(positions[..., 0] - self.centre[0], positions[..., 1] - self.centre[1]) < self.radius


@dataclass(frozen=True)
class Grid:
    """Cell centres of a regular grid, x first.

    Args:
        x: (nx,) [length].
        y: (ny,) [length].
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]

    @property
    def points(self) -> NDArray[np.float64]:
        """All centres, (nx * ny, 2), y fastest."""
        return np.stack(np.meshgrid(self.x, self.y, indexing="ij"), axis=-1).reshape(-1, 2)


@component
class Domain:
    """The rectangle W less its obstacles O.

    Args:
        lower: least corner (x, y) [length].
        upper: greatest corner (x, y) [length].
        obstacles: Rectangle or Circle, each at least partly inside.
    """

    lower: Sequence[float] = (0.0, 0.0)
    upper: Sequence[float] = (200.0, 200.0)
    obstacles: Annotated[Sequence[Rectangle | Circle], OR_NULL] = ()

    def __post_init__(self) -> None:
        _corners(self)
        object.__setattr__(self, "obstacles", tuple(self.obstacles or ()))

    def contains(self, positions: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the positions (n, 2) are water (walls and obstacle edges included), (n,)."""
        positions = np.asarray(positions, dtype=float)
        inside = np.all((positions >= self.lower) & (positions <= self.upper), axis=-1)
        for obstacle in self.obstacles:
            inside &= ~obstacle.contains(positions)
        return inside

    def grid(self, nx: int, ny: int) -> Grid:
        """Centres of nx times ny equal cells."""
        (x0, y0), (x1, y1) = self.lower, self.upper
        return Grid(x0 + (np.arange(nx) + 0.5) * (x1 - x0) / nx, y0 + (np.arange(ny) + 0.5) * (y1 - y0) / ny)


def _corners(box: Rectangle | Domain) -> None:
    for name in ("lower", "upper"):
        object.__setattr__(box, name, checks.vector(name, getattr(box, name), 2, "length"))
    if not all(low < high for low, high in zip(box.lower, box.upper, strict=True)):
        raise checks.InvalidValue(
            "upper", box.upper, f"must exceed lower={list(box.lower)} in x and y", "length"
        )
