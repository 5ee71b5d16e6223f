"""Whether residuals look like the noise: a chi-square test, a test of runs along the path, one of outliers.

Each asks something that the others do not see: residuals that are too large (or too small) all together,
neighbours that err to the same side, one value that is off. Together they are judged after Simes (1986), so
that a true model is blamed in at most so many cases as the level says, also where two say much the same; a
test that could not reach the level whatever the residuals (runs of a few signs) is left out (Tarone 1990).

| symbol | meaning | shape |
|---|---|---|
| z | standardised residuals at the minimum of the deviance | (n,) |
| h | leverage: share of a sample's noise that the fit follows | (n,) |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, chdtrc, gammaln, ndtr, stdtr

from fieldrl.uncertainty.fisher import told_unknowns

LEVEL = 0.05
"""A model is called wrong where a true one would look so bad less often than this."""


@dataclass(frozen=True)
class Misfit:
    """What the tests say; each p is the probability of residuals as unlikely as these under the noise alone.

    Args:
        chi_square: least deviance.
        expected: its expectation, samples less told unknowns.
        p_large: of residuals so large; nan where the noise is not known.
        p_small: of residuals so small; nan where the noise is not known.
        p_runs: of so few changes of sign along the path; nan where so few signs can tell nothing.
        p_outlier: of so large a largest residual.
        outlier: which sample has it.
    """

    chi_square: float
    expected: float
    p_large: float
    p_small: float
    p_runs: float
    p_outlier: float
    outlier: int

    @property
    def p(self) -> float:
        """All tests together: the least of k p_i / i, with p_i in ascending order."""
        chi = 2.0 * min(self.p_large, self.p_small)
        found = sorted(p for p in (chi, self.p_runs, self.p_outlier) if np.isfinite(p))
        return min((len(found) * p / i for i, p in enumerate(found, 1)), default=1.0)

    @property
    def wrong(self) -> bool:
        """Whether the model or the stated noise is wrong, at ``LEVEL``."""
        return self.p < LEVEL


def misfit(z: NDArray, slopes: NDArray, known: bool, paths: NDArray | None = None) -> Misfit:
    """Test residuals.

    Args:
        z: at the minimum, (n,), in the order in which they were taken.
        slopes: their derivatives by the scaled unknowns, (n, p).
        known: whether the noise is known, or estimated from these residuals.
        paths: which path each sample belongs to, (n,); None: one path.
    """
    told, leverage = told_unknowns(slopes), _leverage(slopes)
    chi, expected = float(z @ z), max(len(z) - told, 0.0)
    large, small = (np.nan, np.nan)
    if known and expected >= 0.5:
        large, small = float(chdtrc(expected, chi)), float(chdtr(expected, chi))
    outlier, p_outlier = _outlier(z, leverage, known, told)
    return Misfit(chi, expected, large, small, _runs(z, paths), p_outlier, outlier)


def _leverage(slopes: NDArray) -> NDArray[np.float64]:
    """h of each sample, with what bounds tell beside the samples, (n,)."""
    information = slopes.T @ slopes + 3.0 * np.eye(slopes.shape[1])
    return np.einsum("nk,kl,nl->n", slopes, np.linalg.inv(information), slopes)


def _outlier(z: NDArray, leverage: NDArray, known: bool, told: float) -> tuple[int, float]:
    """The sample with the largest residual, and the probability that the largest is so large."""
    if not len(z):
        return 0, np.nan
    free = len(z) - told - 1.0
    size = np.abs(z) / np.sqrt(np.maximum(1.0 - leverage, 1e-6))
    if known and free < 0.5:
        return int(np.argmax(size)), np.nan  # one residual's worth is told: the chi-square test has seen it
    if known:
        size[leverage > 0.999] = 0.0  # the fit follows it wherever it is
        tail = 2.0 * ndtr(-size)
    elif free >= 1.0 and (rest := float(z @ z)) > 0.0:
        # externally studentised: its own residual is left out of the variance
        others = np.maximum(rest - size**2, 1e-12 * rest) / free
        tail = 2.0 * stdtr(free, -size / np.sqrt(others))
    else:
        return int(np.argmax(size)), np.nan
    worst = int(np.argmin(tail))
    return worst, float(-np.expm1(len(z) * np.log1p(-min(float(tail[worst]), 1.0 - 1e-12))))


def _runs(z: NDArray, paths: NDArray | None) -> float:
    """Probability of so few runs of equal signs (Wald and Wolfowitz), all paths together."""
    labels = np.zeros(len(z), dtype=int) if paths is None else np.asarray(paths)
    up, pieces = z > 0, []
    for path in np.unique(labels):
        signs = up[labels == path]
        pieces.append((int(np.sum(signs)), int(np.sum(~signs)), 1 + int(np.sum(signs[1:] != signs[:-1]))))
    if len(pieces) == 1:
        a, b, runs = pieces[0]
        return _exact(a, b, runs) if _exact(a, b, 2) <= LEVEL / 3 else np.nan
    mean = variance = total = 0.0
    for a, b, runs in pieces:
        if a and b:
            n = a + b
            mean += 1.0 + 2.0 * a * b / n
            variance += 2.0 * a * b * (2.0 * a * b - n) / (n * n * max(n - 1.0, 1.0))
            total += runs
    return float(ndtr((total + 0.5 - mean) / np.sqrt(variance))) if variance > 0 else np.nan


def _exact(a: int, b: int, runs: int) -> float:
    """P(R <= runs) of a ups and b downs in random order."""
    if a == 0 or b == 0:
        return np.nan
    r = np.arange(2, runs + 1)
    half = r // 2
    even = np.log(2.0) + _choose(a - 1, half - 1) + _choose(b - 1, half - 1)
    odd = np.logaddexp(
        _choose(a - 1, half) + _choose(b - 1, half - 1), _choose(a - 1, half - 1) + _choose(b - 1, half)
    )
    log = np.where(r % 2 == 0, even, odd) - _choose(a + b, np.array([a]))
    return float(min(np.sum(np.exp(log)), 1.0))


def _choose(n: int, k: NDArray) -> NDArray[np.float64]:
    """Log of n over k, of nothing where k is not in 0 .. n."""
    inside = (k >= 0) & (k <= n)
    safe = np.where(inside, k, 0)
    return np.where(inside, gammaln(n + 1.0) - gammaln(safe + 1.0) - gammaln(n - safe + 1.0), -1e300)
