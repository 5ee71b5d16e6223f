"""Which unknowns the samples tell: from intervals, distinct solutions, principal axes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.parameters import Parameters
from fieldrl.uncertainty.fisher import Axes
from fieldrl.uncertainty.profile import Profile

NARROW = 0.5
"""An unknown is identified where its 95 % interval is one piece, narrower than this share of its bounds."""

_AT_BOUND = 1e-9
_LOOSE, _TIGHT = 4.0, 10.0  # how many times worse known unknowns and widest axis are, to be worth telling
_KNOWN = 0.25  # a direction that is known at all [half-width]


class Combination(NamedTuple):
    """A combination of unknowns that is known better than they are.

    Args:
        weights: of each unknown, the first that takes part being 1, (p,).
        std: its standard deviation, in the unit of that first unknown.
        first: which unknown that is.
        other: standard deviation along the widest axis, in the same unit.
    """

    weights: NDArray[np.float64]
    std: float
    first: int
    other: float


def identified(profile: Profile) -> NDArray[np.bool_]:
    """Which unknowns the samples tell, (p,)."""
    low, high = profile.intervals.T
    single = np.array([len(parts) == 1 for parts in profile.pieces])
    return single & (high - low < 2.0 * NARROW)


def at_bounds(profile: Profile) -> NDArray[np.bool_]:
    """Which intervals end at a lower, which at an upper bound, (p, 2)."""
    return np.abs(profile.intervals) >= 1.0 - _AT_BOUND


def solutions(profile: Profile, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of places that fit (m, p), the best first: one for each combination of pieces, (k, p)."""
    seen: dict[tuple[int, ...], int] = {}
    for i, place in enumerate(places):
        piece = tuple(piece_of(parts, place[k]) for k, parts in enumerate(profile.pieces))
        seen.setdefault(piece, i)
    return places[list(seen.values())]


def combination(axes: Axes, parameters: Parameters) -> Combination | None:
    """The best known direction, where it says what the unknowns alone do not; None otherwise.

    Worth telling where two or more unknowns of one unit share in it, each of them is at least so many times
    (4) less well known, and the widest axis is wider by 10.
    """
    best, p = axes.directions[-1], len(parameters)
    taking = np.abs(best) > 0.05 * np.abs(best).max()
    if p < 2 or taking.sum() < 2 or len({parameters.units[k] for k in np.flatnonzero(taking)}) > 1:
        return None
    if axes.std[-1] > _KNOWN or not axes.std[0] > _TIGHT * axes.std[-1]:
        return None
    if np.any(axes.marginal[taking] < _LOOSE * axes.std[-1] * np.abs(best[taking])):
        return None
    scale, first = parameters.half_width, int(np.flatnonzero(taking)[0])
    raw = np.where(taking, best, 0.0) / scale
    weights = raw / raw[first]
    widest = np.linalg.norm(axes.directions[0] * scale)
    return Combination(weights, float(axes.std[-1] / abs(raw[first])), first, float(axes.std[0] * widest))


def piece_of(parts: tuple[tuple[float, float], ...], value: float) -> int:
    """Which piece ``value`` lies in, or is nearest to."""
    distance = [max(low - value, value - high, 0.0) for low, high in parts]
    return int(np.argmin(distance))
