"""What the vehicle has measured so far.

| symbol | meaning | shape | unit |
|---|---|---|---|
| x_i | measured positions | (n, 2) | length |
| t_i | times | (n,) | time |
| y_i | measured values | (n,) | field |
| s_i | stated standard deviations | (n,) | field |
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
        std: the stated standard deviation of each value's noise, (n,) [field]; None: not stated.
        censored: which values are a detection limit that the field was at or below, (n,); None: none is.
    """

    positions: NDArray[np.float64]
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    std: NDArray[np.float64] | None = None
    censored: NDArray[np.bool_] | None = None

    @classmethod
    def of(
        cls,
        positions: ArrayLike,
        times: ArrayLike,
        values: ArrayLike,
        std: ArrayLike | None = None,
        censored: ArrayLike | None = None,
    ) -> Samples:
        """Samples from anything array-like; one ``std`` may serve all.

        Raises:
            ValueError: the shapes disagree, or a standard deviation is not positive and finite.
        """
        # compiled loops are compiled anew for arrays that may not be written to, such as columns of pandas
        x, t, y = (np.require(each, float, ["C", "W"]) for each in (positions, times, values))
        x, t, y = x.reshape(-1, 2), t.reshape(-1), y.reshape(-1)
        if not len(x) == len(t) == len(y):
            raise ValueError(f"positions, times and values differ in length: {len(x)}, {len(t)}, {len(y)}")
        s = None if std is None else np.array(np.broadcast_to(np.asarray(std, dtype=float), t.shape))
        if s is not None and not np.all((s > 0) & np.isfinite(s)):
            raise ValueError("standard deviations must be > 0 and finite")
        below = None if censored is None else np.array(np.broadcast_to(np.asarray(censored, bool), t.shape))
        return cls(x, t, y, s, below if below is not None and below.any() else None)

    @classmethod
    def none(cls) -> Samples:
        """No samples yet."""
        return cls(np.empty((0, 2)), np.empty(0), np.empty(0))

    def __len__(self) -> int:
        return self.times.size

    def append(self, position: ArrayLike, time: float, value: float) -> Samples:
        """These samples and one more, last, as a vehicle takes them: nothing is stated of their noise."""
        n = self.times.size
        positions, times, values = np.empty((n + 1, 2)), np.empty(n + 1), np.empty(n + 1)
        positions[:n], positions[n] = self.positions, position
        times[:n], times[n] = self.times, time
        values[:n], values[n] = self.values, value
        return Samples(positions, times, values)

    def without(self, i: int) -> Samples:
        """All samples but the ``i``-th."""
        return self.where(np.arange(len(self)) != i)

    def where(self, chosen: NDArray) -> Samples:
        """Some of the samples: a mask (n,) or their numbers."""
        std = None if self.std is None else self.std[chosen]
        below = None if self.censored is None else self.censored[chosen]
        return Samples(self.positions[chosen], self.times[chosen], self.values[chosen], std, below)
