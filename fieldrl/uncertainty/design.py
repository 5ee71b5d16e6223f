"""Which further samples would tell most: greedy D-optimal design.

| symbol | meaning | shape | unit |
|---|---|---|---|
| F | Fisher information of the samples so far, of unknowns in half-widths of the bounds | (p, p) | 1 |
| S | sensitivities of c candidates, as of core/information.py | (c, p) | 1 |
| C = (I + F)^-1 | covariance; I stands for what the bounds tell | (p, p) | 1 |

A candidate s gains 1/2 log(1 + s C s^T): by so much 1/2 log det(I + F) grows, and the volume of what is
uncertain shrinks by its exponential. The best is taken, F grows by s^T s, and so on. The gain of a set is
submodular, so a greedy set has at least 1 - 1/e of the gain of the best set of its size
(Nemhauser, Wolsey and Fisher 1978).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fieldrl.uncertainty.fisher import Axes, axes


def information_of(found: Axes) -> NDArray[np.float64]:
    """F from the principal axes of an estimate's uncertainty, (p, p); 0 along what is not told."""
    rows = _root(found)
    return rows.T @ rows


def gains(information: NDArray[np.float64], sensitivities: NDArray[np.float64]) -> NDArray[np.float64]:
    """What each candidate alone gains, of F (p, p) and S (c, p): (c,) [nat]."""
    covariance = np.linalg.inv(np.eye(len(information)) + information)
    return 0.5 * np.log1p(np.einsum("ci,ij,cj->c", sensitivities, covariance, sensitivities))


def greedy(
    information: NDArray[np.float64],
    sensitivities: NDArray[np.float64],
    count: int,
    excluded: Callable[[int], NDArray[np.bool_]] | None = None,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The candidates that tell most together, each once.

    Args:
        information: F, (p, p).
        sensitivities: S, (c, p).
        count: how many.
        excluded: candidates (c,) that may not be taken beside one that was; None: itself alone.

    Returns:
        Their numbers in the order of choice, (k,), and what each gains after those before it, (k,) [nat];
        k < count where no candidate is left.
    """
    known, free = information.copy(), np.ones(len(sensitivities), dtype=bool)
    chosen: list[int] = []
    gained: list[float] = []
    while len(chosen) < count and free.any():
        each = np.where(free, gains(known, sensitivities), -np.inf)
        best = int(np.argmax(each))
        chosen.append(best)
        gained.append(float(each[best]))
        known = known + np.outer(sensitivities[best], sensitivities[best])
        free[best] = False
        if excluded is not None:
            free &= ~excluded(best)
    return np.array(chosen, dtype=np.int64), np.array(gained)


def expected_std(information: NDArray[np.float64], sensitivities: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard deviation of each unknown after 0, 1, ... k more samples, by Fisher information alone.

    Args:
        information: F, (p, p).
        sensitivities: of the samples in their order, (k, p).

    Returns:
        (k + 1, p) [half-width]; infinite where nothing is told.
    """
    values, vectors = np.linalg.eigh(information)
    rows = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    after = (axes(np.vstack([rows, sensitivities[:k]])) for k in range(len(sensitivities) + 1))
    return np.array([found.marginal for found in after])


def _root(found: Axes) -> NDArray[np.float64]:
    """Rows R with F = R^T R."""
    told = np.isfinite(found.std)
    return found.directions[told] / found.std[told, None]
