"""Deterministic points: where a search begins, what covers the box.

All points u are in half-widths of the bounds, |u| <= 1. Nothing here is random: the same call gives the
same numbers, so an estimator is a pure function of its fit problem.
"""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc


@lru_cache(maxsize=32)
def additive_recurrence(count: int, p: int) -> NDArray[np.float64]:
    """Points that fill the box ever more evenly, the first in its centre (Roberts' R sequence), (count, p).

    Coordinate j of point i is the fraction of 1/2 + i g^-(j+1), where g^(p+1) = g + 1.
    """
    g = 2.0
    for _ in range(64):
        g = (1.0 + g) ** (1.0 / (p + 1))
    steps = g ** -np.arange(1.0, p + 1)
    return _frozen(2.0 * ((0.5 + np.arange(count)[:, None] * steps) % 1.0) - 1.0)


@lru_cache(maxsize=32)
def cover(exponent: int, p: int) -> NDArray[np.float64]:
    """2^exponent scrambled Sobol' points of the box, (2^exponent, p)."""
    return _frozen(2.0 * qmc.Sobol(p, rng=np.random.default_rng(1)).random_base2(exponent) - 1.0)


@lru_cache(maxsize=8)
def length_scales(p: int) -> NDArray[np.float64]:
    """Length scales that a kernel may have in each direction, from 0.08 to 2.5 half-widths, (c, p)."""
    if p > 2:
        return _frozen(0.08 * (2.5 / 0.08) ** ((cover(7, p) + 1.0) / 2.0))
    axis = np.geomspace(0.08, 2.5, 24 if p == 1 else 9)
    return _frozen(np.array(list(itertools.product(*[axis] * p))))


def _frozen(points: NDArray[np.float64]) -> NDArray[np.float64]:
    points = np.ascontiguousarray(points)
    points.flags.writeable = False
    return points
