"""What the vehicle has measured so far.

| symbol | meaning | shape | unit |
|---|---|---|---|
| x_i | measured positions | (n, 2) | length |
| t_i | times | (n,) | time |
| y_i | measured values | (n,) | field |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Samples:
    """n samples of the field, frozen; ``append`` and ``without`` return new ones.

    Args:
        positions: where, (n, 2) [length].
        times: when, (n,) [time].
        values: what, (n,) [field].
    """

    positions: NDArray[np.float64]
    times: NDArray[np.float64]
    values: NDArray[np.float64]

    @classmethod
    def of(cls, positions: ArrayLike, times: ArrayLike, values: ArrayLike) -> Samples:
        """Samples from anything array-like; raises ValueError where the shapes disagree."""
        x = np.ascontiguousarray(positions, dtype=float).reshape(-1, 2)
        t = np.ascontiguousarray(times, dtype=float).reshape(-1)
        y = np.ascontiguousarray(values, dtype=float).reshape(-1)
        if not len(x) == len(t) == len(y):
            raise ValueError(f"positions, times and values differ in length: {len(x)}, {len(t)}, {len(y)}")
        return cls(x, t, y)

    @classmethod
    def none(cls) -> Samples:
        """No samples yet."""
        return cls(np.empty((0, 2)), np.empty(0), np.empty(0))

    def __len__(self) -> int:
        return self.times.size

    def append(self, position: ArrayLike, time: float, value: float) -> Samples:
        """These samples and one more, last."""
        n = self.times.size
        positions, times, values = np.empty((n + 1, 2)), np.empty(n + 1), np.empty(n + 1)
        positions[:n], positions[n] = self.positions, position
        times[:n], times[n] = self.times, time
        values[:n], values[n] = self.values, value
        return Samples(positions, times, values)

    def without(self, i: int) -> Samples:
        """All samples but the ``i``-th."""
        keep = np.arange(len(self)) != i
        return Samples(self.positions[keep], self.times[keep], self.values[keep])
