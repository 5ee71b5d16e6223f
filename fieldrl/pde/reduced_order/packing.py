"""A reduced model as one array of numbers, which its compiled functions read.

The head says where everything else is; modes and coefficients are in single precision, two to a number.
The last part is a memo, see ``kernel``; it is not kept on disk.

| part | what | size |
|---|---|---|
| head | below | HEAD |
| axes | N, stride, pieces, where breaks and pieces are, centre, half width, where guesses are | AXIS each |
| times | time, rank r, where modes (cells, r) and coefficients (r, N_1, ..., N_p) are | TIME each |
| memo | labels (x, y, t, number of the call), then a table (N_1, ..., N_p) for each sample | SLOTS |
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.pde.reduced_order.splines import Axis

HEAD, AXIS, TIME, LABEL = 20, 8, 4, 4
P, TIMES, NX, NY, LEFT, WIDE, LOW, HIGH, TABLE, AXES_AT, TIMES_AT, LABELS_AT, TABLES_AT, CALLS, SIZE = range(
    15
)
SLOTS = 4096
"""Samples that the memo holds."""
BLOCK = 4
"""Modes are filled up with zeros to a multiple of it."""
BINS = 256
"""Equal parts of an axis, for each of which the piece of the spline at its beginning is noted: a guess."""


class Decomposed(NamedTuple):
    """One time: modes (r, cells) and coefficients of the B-splines (N_1, ..., N_p, r)."""

    time: float
    modes: NDArray[np.float64]
    coefficients: NDArray[np.float64]


def packed(
    axes: Sequence[Axis],
    scales: Sequence[tuple[float, float]],
    walls: tuple[Sequence[float], Sequence[float]],
    cells: tuple[int, int],
    times: Sequence[Decomposed],
) -> NDArray[np.float64]:
    """Everything but the memo.

    Args:
        axes: of the tensor grid.
        scales: centre and half width of each unknown.
        walls: least and greatest corner of the domain [length].
        cells: (nx, ny).
        times: in ascending order.
    """
    shape = [len(one.nodes) for one in axes]
    strides = [int(np.prod(shape[k + 1 :])) for k in range(len(shape))]
    tail = _Tail(HEAD + AXIS * len(axes) + TIME * len(times))
    of_axes = [
        [len(one.nodes), stride, len(one.pieces), tail.put(one.breaks), tail.put(one.pieces), *scale, guesses]
        for one, stride, scale, guesses in zip(axes, strides, scales, map(tail.guesses, axes), strict=True)
    ]
    of_times = [tail.time(one) for one in times]
    head = np.zeros(HEAD)
    (x0, y0), (x1, y1), (nx, ny) = *walls, cells
    head[: TABLE + 1] = len(axes), len(times), nx, ny, x0, (x1 - x0) / nx, y0, (y1 - y0) / ny, np.prod(shape)
    head[AXES_AT : TIMES_AT + 1] = HEAD, HEAD + AXIS * len(axes)
    head[LABELS_AT : TABLES_AT + 1] = tail.size, tail.size + LABEL * SLOTS
    head[SIZE] = tail.size + (LABEL + np.prod(shape)) * SLOTS
    return np.concatenate([head, np.ravel(of_axes), np.ravel(of_times), *tail.parts])


def with_memo(kept: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same with an empty memo, in memory of its own; what is not used of it takes none."""
    constants = np.empty(int(kept[SIZE]))
    constants[: len(kept)] = kept
    constants[len(kept) : int(kept[TABLES_AT])] = np.nan
    return constants


class _Tail:
    """Arrays one after the other, and where the next one comes."""

    def __init__(self, start: int) -> None:
        self.size, self.parts = start, []

    def put(self, values: NDArray) -> int:
        """Where the values begin."""
        self.parts.append(np.ravel(values))
        self.size += self.parts[-1].size
        return self.size - self.parts[-1].size

    def guesses(self, axis: Axis) -> int:
        """Where the guesses of an axis begin."""
        begins = -1 + np.arange(BINS) * 2 / BINS
        return self.put(np.maximum(np.searchsorted(axis.breaks[:-1], begins, side="right") - 1.0, 0.0))

    def time(self, one: Decomposed) -> list[float]:
        """The entry of a time."""
        missing = -len(one.modes) % BLOCK
        fields = np.pad(one.modes, ((0, missing), (0, 0)))
        of_splines = np.pad(
            np.moveaxis(one.coefficients, -1, 0).reshape(len(one.modes), -1), ((0, missing), (0, 0))
        )
        return [one.time, len(fields), self.single(fields.T), self.single(of_splines)]

    def single(self, values: NDArray) -> int:
        """The same in single precision, two to a number."""
        halves = np.ravel(values).astype(np.float32)
        return self.put(np.pad(halves, (0, halves.size % 2)).view(np.float64))
