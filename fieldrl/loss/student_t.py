"""Student's t: the loss of noise with heavy tails (K. L. Lange et al., J. Am. Stat. Assoc. 84, 881, 1989)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class StudentT:
    """rho(z) = (v + 1) log(1 + z^2 / v), minus twice the log likelihood up to a constant.

    Args:
        freedom: v, degrees of freedom; the fewer, the less an outlier counts.
    """

    freedom: float = 4.0
    robust = True

    def __post_init__(self) -> None:
        checks.positive("freedom", self.freedom)

    def root(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """s(z), of the shape of z."""
        v = self.freedom
        return np.sign(z) * np.sqrt((v + 1) * np.log1p(z**2 / v))

    def slope(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """ds/dz."""
        v, s = self.freedom, np.abs(self.root(z))
        small = s < 1e-6
        ratio = np.where(small, np.sqrt(v / (v + 1)), np.abs(z) / np.where(small, 1.0, s))
        return (v + 1) / (v + z**2) * ratio

    def inverse(self, s: NDArray[np.float64]) -> NDArray[np.float64]:
        """z(s)."""
        v = self.freedom
        return np.sign(s) * np.sqrt(v * np.expm1(s**2 / (v + 1)))
