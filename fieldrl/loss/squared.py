"""The squared loss: least squares, for normal noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.kinds import component


@component
class Squared:
    """rho(z) = z^2."""

    robust = False

    def root(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """s(z), of the shape of z."""
        return z

    def slope(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """ds/dz."""
        return np.ones_like(z)

    def inverse(self, s: NDArray[np.float64]) -> NDArray[np.float64]:
        """z(s)."""
        return s
