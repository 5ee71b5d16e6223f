"""Huber's loss: squared near 0, linear beyond (P. J. Huber, Ann. Math. Statist. 35, 73, 1964)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class Huber:
    """rho(z) = z^2 where |z| <= k, else 2 k |z| - k^2.

    Args:
        threshold: k; 1.345 keeps 95 % of the efficiency of least squares for normal noise.
    """

    threshold: float = 1.345
    robust = True

    def __post_init__(self) -> None:
        checks.positive("threshold", self.threshold)

    def root(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """s(z), of the shape of z."""
        k, size = self.threshold, np.abs(z)
        return np.sign(z) * np.where(size <= k, size, np.sqrt(2 * k * np.maximum(size, k) - k**2))

    def slope(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """ds/dz."""
        k = self.threshold
        return k / np.maximum(np.abs(self.root(z)), k)

    def inverse(self, s: NDArray[np.float64]) -> NDArray[np.float64]:
        """z(s)."""
        k, size = self.threshold, np.abs(s)
        return np.sign(s) * np.where(size <= k, size, (s**2 + k**2) / (2 * k))
