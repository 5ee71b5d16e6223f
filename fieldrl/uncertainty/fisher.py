"""Fisher information of the scaled unknowns, and the covariance that it bounds.

| symbol | meaning | shape |
|---|---|---|
| J | derivatives of the standardised residuals by u | (n, p) |
| F = J^T J | Fisher information | (p, p) |
| V | principal axes of the estimate's uncertainty, the widest first | (p, p) |
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_SINGULAR = 1e-14  # of F's greatest eigenvalue: rounding


class Axes(NamedTuple):
    """Principal axes of an estimate's uncertainty.

    Args:
        directions: unit vectors of u in rows, the widest first, (p, p).
        std: standard deviation along each, infinite where nothing is told, (p,) [half-width].
    """

    directions: NDArray[np.float64]
    std: NDArray[np.float64]

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Of u, (p, p); infinite where a direction that is not told has a part in it."""
        told = np.isfinite(self.std)
        finite = (self.directions[told].T * self.std[told] ** 2) @ self.directions[told]
        untold = np.any(np.abs(self.directions[~told]) > 1e-7, axis=0)
        finite[np.ix_(untold, untold)] = np.inf
        return finite

    @property
    def marginal(self) -> NDArray[np.float64]:
        """Standard deviation of each unknown, (p,) [half-width]."""
        return np.sqrt(np.diag(self.covariance))


def axes(slopes: NDArray[np.float64], variance: float = 1.0) -> Axes:
    """Principal axes of F^-1 times ``variance``, from J (n, p)."""
    values, vectors = np.linalg.eigh(slopes.T @ slopes)
    told = values > max(_SINGULAR * values[-1], 1e-300)
    std = np.full(len(values), np.inf)
    std[told] = np.sqrt(variance / values[told])
    return Axes(vectors.T.copy(), std)


def told_unknowns(slopes: NDArray[np.float64]) -> float:
    """How many unknowns the samples tell beyond what the bounds do: the sum of F / (F + 3 I), 0 to p.

    3 is the information of bounds alone: a uniform distribution over |u| <= 1 has a variance of 1/3.
    """
    values = np.maximum(np.linalg.eigvalsh(slopes.T @ slopes), 0.0)
    return float(np.sum(values / (values + 3.0)))
