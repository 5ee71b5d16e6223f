"""Splines of degree 5 on graded nodes, tensor products of them, and their pieces as polynomials.

| symbol | meaning | shape |
|---|---|---|
| u | a scaled unknown, in [-1, 1] | |
| N | nodes of an axis, as many as B-splines | |
| breaks | where the pieces of a spline begin, and where the last one ends | (N - 4,) |
| pieces | piece i in powers of u - breaks[i]: of it, B-splines i to i + 5 are not zero | (N - 5, 6, 6) |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

DEGREE = 5
WIDTH = DEGREE + 1
"""B-splines that are not zero at a point; the fewest nodes of an axis."""


class Axis(NamedTuple):
    """One axis of a tensor grid: nodes (N,), breaks (N - 4,), pieces (N - 5, power, B-spline)."""

    nodes: NDArray[np.float64]
    breaks: NDArray[np.float64]
    pieces: NDArray[np.float64]


def axis(nodes: NDArray[np.float64]) -> Axis:
    """The axis with these nodes, ascending, at least WIDTH of them."""
    spline = make_interp_spline(nodes, np.eye(len(nodes)), k=DEGREE)
    basis, breaks = BSpline(spline.t, np.eye(len(nodes)), DEGREE), spline.t[DEGREE:-DEGREE]
    powers = [basis.derivative(power)(breaks[:-1]) / math.factorial(power) for power in range(1, WIDTH)]
    taylor = np.stack([basis(breaks[:-1]), *powers], axis=1)
    own = np.arange(len(breaks) - 1)[:, None] + np.arange(WIDTH)
    return Axis(nodes, breaks, np.take_along_axis(taylor, own[:, None, :], axis=2))


def coefficients(axes: Sequence[Axis], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of the B-splines from values at all nodes, both (N_1, ..., N_p, r)."""
    for place, one in enumerate(axes):
        values = np.moveaxis(make_interp_spline(one.nodes, values, k=DEGREE, axis=place).c, 0, place)
    return values


def resampled(nodes: NDArray, values: NDArray, targets: NDArray) -> NDArray[np.float64]:
    """Values (n, r) at ``nodes`` (n,), by their spline at ``targets`` (N,): (N, r)."""
    if len(nodes) == len(targets) and np.array_equal(nodes, targets):
        return values
    return make_interp_spline(nodes, values, k=DEGREE)(targets)
