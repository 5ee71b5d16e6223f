"""The noise that samples are believed to have, and how much a deviance may rise above its minimum.

| symbol | meaning | shape |
|---|---|---|
| D(u) = sum of ((prediction - value) / std)^2 | deviance | |
| q | what D may rise above its minimum within a region of some probability | |
| n, p | samples, unknowns | |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri, gammaincinv

from fieldrl.core.samples import Samples


@dataclass(frozen=True)
class Noise:
    """Normal noise, independent from sample to sample.

    Args:
        std: standard deviation of each sample, (n,) [field unit]; relative to each other where not known.
        known: whether their size is known, or follows from the residuals.
        elsewhere: where other residuals told it: by how much ``std`` squared is to be multiplied, and the
            degrees of freedom behind that; None: these residuals tell it.
    """

    std: NDArray[np.float64]
    known: bool
    elsewhere: tuple[float, int] | None = None

    def variance(self, least: float, unknowns: int) -> float:
        """How many times ``std`` squared the variance is: 1 where it is known.

        Args:
            least: the least deviance.
            unknowns: p.
        """
        if self.known:
            return 1.0
        if self.elsewhere is not None:
            return self.elsewhere[0]
        free = self.free(unknowns)
        return max(least, _LEAST) / free if free > 0 else np.inf

    def free(self, unknowns: int) -> int:
        """Degrees of freedom that tell the size of the noise, where it is estimated."""
        return len(self.std) - unknowns if self.elsewhere is None else self.elsewhere[1]

    def rise(self, level: float, dimensions: int, least: float, unknowns: int) -> float:
        """q: D <= least + q is the region of probability ``level`` for so many unknowns together.

        Chi-square where the noise is known; F (for one unknown: Student's t squared) where it is estimated,
        infinite where there is no sample left to estimate it from.

        Args:
            level: in (0, 1).
            dimensions: 1 for an interval, p for the joint region.
            least: the least deviance.
            unknowns: p.
        """
        if self.known:
            return 2.0 * float(gammaincinv(dimensions / 2, level))
        free = self.free(unknowns)
        if free <= 0:
            return np.inf
        return dimensions * float(fdtri(dimensions, free, level)) * self.variance(least, unknowns)

    def log_likelihood(self, above: NDArray[np.float64], least: float, unknowns: int) -> NDArray[np.float64]:
        """Log likelihood, less its greatest value; the size of noise that is estimated is integrated out.

        That makes a normal distribution of the unknowns one of Student's: regions of equal likelihood rise
        as ``rise`` says. Where nothing tells the noise all are as likely.

        Args:
            above: deviance less the least one, any shape.
            least: the least deviance.
            unknowns: p.
        """
        if self.known:
            return -0.5 * above
        free = self.free(unknowns)
        if free <= 0:
            return np.zeros_like(above)
        return (
            -0.5
            * (free + unknowns)
            * np.log1p(np.maximum(above, 0.0) / (free * self.variance(least, unknowns)))
        )


_LEAST = 1e-18  # of a deviance [field unit^2]: residuals of rounding alone


def noise_of(samples: Samples, sensor: float | None) -> Noise:
    """What is known of the samples' noise: their own standard deviations, else the sensor's.

    Args:
        samples: n samples.
        sensor: standard deviation of a sample's noise; 0 or None: not known [field unit].
    """
    if samples.std is not None:
        return Noise(samples.std, True)
    return Noise(np.full(len(samples), sensor or 1.0), bool(sensor))
