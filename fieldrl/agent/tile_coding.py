"""Tile coding (section 4.2; Sutton & Barto 2018, section 9.5.4), without hashing.

Several tilings cover the observed range, each displaced by a fraction of a tile. In each tiling exactly
one tile is active. Tilings are numbered k = 0 ... T - 1, tiled variables j = 0 ... d - 1; tiling k is
displaced in variable j by (k m_j mod T) / T of a tile, where m_j is the variable's displacement:

- ``uniform``: m_j = 1. Tilings are displaced along the diagonal.
- ``asymmetric``: m_j = 1, 3, 5, 7, ..., the odd numbers that share no factor with T. It generalises more
  evenly around a point; Sutton & Barto recommend it.

A tile is so wide, range / (tiles - greatest displacement), that every tiling covers the whole range: nothing
within the bounds is clipped. A value outside them falls into the tile at the edge. Tiles hold their lower
side; the last one in the most displaced tiling holds the upper bound too. Tiles do not join across
-pi and pi where the heading is free.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import count, islice

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.kernels import active_features
from fieldrl.core import checks
from fieldrl.core.kinds import component

OWN = ("x", "y", "heading", "time")
OBSERVED = (
    *OWN, "value", "uncertainty", "plume_x", "plume_y", "plume_distance", "plume_bearing", "plume_nearness",
)  # fmt: skip
"""In the order of the observation, see ``fieldrl.observation``; estimate_1, deviation_1, ... follow."""
_BY_UNKNOWN = ("estimate", "deviation")
OFFSETS = ("asymmetric", "uniform")
MOST_FEATURES = 10_000_000


@component
class TileCoding:
    """Which tilings, of which observed variables.

    Args:
        tilings: T >= 1.
        tiles: tiles in each tiled variable, >= 1, (d,), or one number for all of them.
        variables: which of ``OBSERVED``, estimate_1, deviation_1, ... are tiled, (d,).
        offsets: "asymmetric" or "uniform".
    """

    tilings: int = 8
    tiles: Sequence[int] | int = (8, 8)
    variables: Sequence[str] = ("x", "y")
    offsets: str = "asymmetric"

    def __post_init__(self) -> None:
        object.__setattr__(self, "tilings", checks.integer("tilings", self.tilings, 1))
        object.__setattr__(self, "variables", _variables(self.variables))
        object.__setattr__(self, "tiles", _tiles(self.tiles, len(self.variables)))
        checks.one_of("offsets", self.offsets, OFFSETS)
        if self.features > MOST_FEATURES:
            rule = f"with {self.tilings} tilings must give at most {MOST_FEATURES} features"
            raise checks.InvalidValue(
                "tiles", self.tiles, rule, remedy="tile fewer variables or more coarsely"
            )

    @property
    def features(self) -> int:
        """Features of an action: tilings times the product of tiles."""
        return self.tilings * math.prod(self.tiles)  # type: ignore[arg-type]

    def displacements(self) -> NDArray[np.float64]:
        """How far each tiling is displaced, in tiles, (T, d), each in [0, 1)."""
        odd = (m for m in count(1, 2) if math.gcd(m, self.tilings) == 1)
        d = len(self.variables)
        multipliers = np.array(list(islice(odd, d)) if self.offsets == "asymmetric" else [1] * d)
        return np.arange(self.tilings)[:, None] * multipliers % self.tilings / self.tilings

    def coder(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
        """The coding of observations within the bounds as the compiled code wants it, (d, 4 + T).

        Args:
            low: least value of each observed variable, (k,).
            high: greatest value of each, (k,).

        Raises:
            InvalidValue: a tiled variable is not observed, or has no finite range.
        """
        indices = [_index(name) for name in self.variables]
        if max(indices) >= len(low):
            rule = f"the agent observes {len(low)} variables only, and not all of these"
            raise checks.InvalidValue("variables", self.variables, rule, remedy="use observation=informed")
        origin, width = np.asarray(low, dtype=float)[indices], (np.asarray(high, dtype=float) - low)[indices]
        if not np.all(np.isfinite(width) & (width > 0)):
            raise checks.InvalidValue("variables", self.variables, "must have finite bounds, low < high")
        offsets = self.displacements()
        scale = (np.asarray(self.tiles) - offsets.max(axis=0)) / width
        return np.column_stack([indices, origin, scale, self.tiles, offsets.T])

    def active(self, observation: NDArray[np.float64], coder: NDArray[np.float64]) -> NDArray[np.int64]:
        """The active feature of each tiling, (T,), for an observation (k,).

        The features of tiling k are k prod(tiles) ... (k + 1) prod(tiles) - 1, last variable fastest.
        """
        return active_features(observation, coder)


def _index(name: str) -> int:
    """Where a variable is in the observation; -1 for a name that no variable has."""
    kind, _, number = name.rpartition("_")
    if kind in _BY_UNKNOWN and number.isdecimal() and int(number) > 0:
        return len(OBSERVED) + len(_BY_UNKNOWN) * (int(number) - 1) + _BY_UNKNOWN.index(kind)
    return OBSERVED.index(name) if name in OBSERVED else -1


def _variables(value: Sequence[str]) -> tuple[str, ...]:
    rule = f"must be a list of different names out of {', '.join(OBSERVED)}, estimate_1, deviation_1, ..."
    if isinstance(value, str) or not isinstance(value, Sequence) or not value:
        raise checks.InvalidValue("variables", value, rule)
    if not all(isinstance(name, str) and _index(name) >= 0 for name in value) or len(set(value)) < len(value):
        raise checks.InvalidValue("variables", value, rule)
    return tuple(value)


def _tiles(value: Sequence[int] | int, size: int) -> tuple[int, ...]:
    """``value`` for each of ``size`` variables."""
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray):
        return (checks.integer("tiles", value, 1),) * size
    if len(value) != size:
        rule = f"must be one whole number, or one for each of the {size} tiled variables"
        raise checks.InvalidValue("tiles", value, rule, remedy="set tiles and variables together")
    return tuple(checks.integer("tiles", tiles, 1) for tiles in value)
