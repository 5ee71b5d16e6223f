"""Where solves are needed: close together where the field changes fast with the unknowns.

A pilot, solves on a coarse grid at regular points, tells how far the field moves between them. Nodes are
graded by these lengths. They lie on lines along the axis that has most; a line along which the field moves
less has fewer of them.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns | (p,) |
| lengths | rms change of the field from one point of the pilot to the next, along an axis | (k,) |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from fieldrl.pde.reduced_order.splines import WIDTH

_POWER = 0.7  # density of nodes grows with so much of the field's speed; 1 leaves quiet stretches too few
_LEAST = 0.3  # of the mean density, everywhere
_FINE, _COARSE = 33, {1: 33, 2: 9}  # points of the pilot along the lines; along other axes, by unknowns
_LINE_POWER = 0.5  # nodes of a line grow with so much of what the field moves along it


class Line(NamedTuple):
    """Solves along one axis: where the others are, (p - 1,), and nodes (n,)."""

    others: NDArray[np.float64]
    nodes: NDArray[np.float64]


class Nodes(NamedTuple):
    """Nodes of every axis, the axis of the lines, and the lines in the order of the other axes' nodes."""

    axes: tuple[NDArray[np.float64], ...]
    along: int
    lines: tuple[Line, ...]

    @property
    def points(self) -> NDArray[np.float64]:
        """Scaled unknowns of every solve, line by line, (s, p)."""
        return np.concatenate([self._points(line) for line in self.lines])

    def _points(self, line: Line) -> NDArray[np.float64]:
        others = np.broadcast_to(line.others, (len(line.nodes), len(line.others)))
        return np.insert(others, self.along, line.nodes, axis=1)


def pilot_axes(counts: Sequence[int]) -> tuple[NDArray[np.float64], ...]:
    """Where the pilot solves: regular points of each axis."""
    along, p = int(np.argmax(counts)), len(counts)
    return tuple(np.linspace(-1, 1, _FINE if k == along else _COARSE.get(p, 5)) for k in range(p))


def nodes(counts: Sequence[int], pilot: Sequence[NDArray], fields: NDArray) -> Nodes:
    """Nodes from a pilot.

    Args:
        counts: nodes of each axis, (p,).
        pilot: its axes.
        fields: what it found, (points of axis 1, ..., of axis p, values).
    """
    p, along = len(counts), int(np.argmax(counts))
    squares = [np.mean(np.diff(fields, axis=k) ** 2, axis=-1, dtype=float) for k in range(p)]
    rest = [tuple(a for a in range(p) if a != k) for k in range(p)]
    lengths = [np.sqrt(squares[k].mean(axis=rest[k])) for k in range(p)]
    axes = tuple(graded(count, one) for count, one in zip(counts, lengths, strict=True))
    travelled = np.sqrt(squares[along]).sum(axis=along)
    others = [one for k, one in enumerate(axes) if k != along]
    grid = np.stack(np.meshgrid(*others, indexing="ij"), axis=-1).reshape(-1, p - 1)
    share = _at(grid, [one for k, one in enumerate(pilot) if k != along], travelled / travelled.max())
    return Nodes(axes, along, tuple(_line(*one, counts[along], lengths[along]) for one in zip(grid, share)))  # noqa: B905


def graded(count: int, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """``count`` nodes from -1 to 1 for changes (k,) between k + 1 regular points."""
    density = lengths**_POWER / max(np.mean(lengths**_POWER), 1e-300)
    middles = -1 + (np.arange(len(lengths)) + 0.5) * 2 / len(lengths)
    fine = np.linspace(-1, 1, 64 * len(lengths) + 1)
    there = np.interp(fine, middles, np.maximum(density, _LEAST))
    total = np.concatenate([[0.0], np.cumsum(there[1:] + there[:-1])])
    found = np.interp(np.linspace(0, 1, count), total / total[-1], fine)
    found[0], found[-1] = -1.0, 1.0
    return found


def _line(others: NDArray, share: float, most: int, lengths: NDArray) -> Line:
    count = min(most, max(WIDTH, math.ceil(most * share**_LINE_POWER)))
    return Line(others, graded(count, lengths))


def _at(points: NDArray, axes: Sequence[NDArray], values: NDArray) -> NDArray[np.float64]:
    """Linear interpolation on a grid, (m,); a number where there is no axis."""
    if not axes:
        return np.full(len(points), float(values))
    return RegularGridInterpolator(axes, values)(points)
