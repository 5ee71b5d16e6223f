"""Joint regions of two unknowns: how far the deviance rises about every solution.

The other unknowns are as they fit best. A solution's map covers its pieces of both intervals and a margin:
a joint region is wider than intervals are.
With very many samples the deviance about a solution is taken to be quadratic.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns (theta - theta0) / s | (p,) |
| D, D0 | deviance, its least value | |
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.uncertainty.assessment import Assessment
from fieldrl.uncertainty.deviance import descend
from fieldrl.uncertainty.fisher import axes
from fieldrl.uncertainty.identifiability import piece_of

SOLUTIONS = 4
"""So many are mapped, the best."""

SIZE = 41
"""Points of a map each way."""

LEVELS = (0.5, 0.95)
"""Probabilities of the regions."""

_UNKNOWNS = 3  # whose pairs are mapped, at most: the first
_MANY = 300  # samples from which on the deviance is taken to be quadratic
_MARGIN = 1.5  # of a map, in half the widths of intervals
_WEAK = 1e-9  # information of a direction that is not told


class Regions(NamedTuple):
    """Maps of all k pairs of unknowns and all solutions, NaN where there is no solution.

    Args:
        pairs: which unknowns, (k, 2).
        first: values of the first of a pair, (k, SOLUTIONS, SIZE).
        second: of the other.
        above: D - D0, (k, SOLUTIONS, SIZE, SIZE).
        rise: what that may be within the regions of ``LEVELS``, (2,).
        solutions: theta, (SOLUTIONS, p).
    """

    pairs: NDArray[np.int64]
    first: NDArray[np.float64]
    second: NDArray[np.float64]
    above: NDArray[np.float64]
    rise: NDArray[np.float64]
    solutions: NDArray[np.float64]


def nowhere(p: int) -> Regions:
    """The regions of p unknowns where there is no estimate."""
    pairs = np.array(list(itertools.combinations(range(min(p, _UNKNOWNS)), 2)), dtype=np.int64).reshape(-1, 2)
    sides = len(pairs), SOLUTIONS, SIZE
    shapes = sides, sides, (*sides, SIZE), (len(LEVELS),), (SOLUTIONS, p)
    return Regions(pairs, *(np.full(shape, np.nan) for shape in shapes))


def regions(assessed: Assessment) -> Regions:
    """The joint regions about an assessment's solutions."""
    parameters, p = assessed.parameters, len(assessed.parameters)
    found = nowhere(p)
    found.rise[:] = [assessed.stated.rise(level, 2, assessed.least, p) for level in LEVELS]
    scaled = (assessed.solutions[:SOLUTIONS] - parameters.centre) / parameters.half_width
    found.solutions[: len(scaled)] = assessed.solutions[:SOLUTIONS]
    for (i, pair), (j, u) in itertools.product(enumerate(found.pairs), enumerate(scaled)):
        sides = [_side(assessed, int(k), u[k]) for k in pair]
        found.above[i, j] = _above(assessed, u, pair, *sides)
        for side, k, kept in zip(sides, pair, (found.first, found.second), strict=True):
            kept[i, j] = parameters.centre[k] + parameters.half_width[k] * side
    return found


def _side(assessed: Assessment, k: int, value: float) -> NDArray[np.float64]:
    """Values of unknown k about a solution, (SIZE,) [half-width]."""
    parts = assessed.profile.pieces[k]
    low, high = parts[piece_of(parts, value)]
    middle, reach = (low + high) / 2.0, _MARGIN * max(high - low, 1e-9) / 2.0
    return np.linspace(max(middle - reach, -1.0), min(middle + reach, 1.0), SIZE)


def _above(assessed: Assessment, u: NDArray, pair: NDArray, x: NDArray, y: NDArray) -> NDArray[np.float64]:
    """D - D0 over x and y, the other unknowns as they fit best, (SIZE, SIZE)."""
    points = np.tile(u, (SIZE * SIZE, 1))
    points[:, pair] = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    if len(assessed.noise) > _MANY:
        return _quadratic(assessed, u, pair, points).reshape(SIZE, SIZE)
    held = np.zeros(points.shape, dtype=bool)
    held[:, pair] = True
    losses = assessed.deviance.at(points) if held.all() else descend(assessed.deviance, points, held)[1]
    return (losses - assessed.least).reshape(SIZE, SIZE)


def _quadratic(assessed: Assessment, u: NDArray, pair: NDArray, points: NDArray) -> NDArray[np.float64]:
    """The same by the information at a solution u, (m,)."""
    z, slopes = assessed.deviance.linearise(u[None])
    weak = np.sqrt(_WEAK) * np.eye(len(u))
    covariance = axes(np.vstack([slopes[0], weak])).covariance[np.ix_(pair, pair)]
    off = points[:, pair] - u[pair]
    return z[0] @ z[0] - assessed.least + np.einsum("mk,kl,ml->m", off, np.linalg.inv(covariance), off)
