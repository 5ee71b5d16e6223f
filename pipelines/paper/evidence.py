"""What replicates say of a median: sign tests, intervals, and the smallest effect that would have been seen.

A replicate is the unit: its episodes share an agent and so are no independent samples. The sign test asks
nothing of the distribution; its statistic is the number of replicates k out of n on one side of a bound.

| symbol | meaning | shape |
|---|---|---|
| d | effect in each replicate, positive as claimed | (n,) |
| alpha | level of a test | |
| k | replicates that a test needs on its side | |
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import beta, binom, binomtest, bootstrap

CONFIDENCE = 0.95  # of the intervals
POWER = 0.8  # with which the smallest effect would have been seen
_RESAMPLES, _SEED = 5000, 0


def above(values: ArrayLike, bound: float) -> float:
    """p of the sign test that the median of ``values`` (n,) is above ``bound``; ties speak against it."""
    values = np.asarray(values, dtype=float)
    return float(binomtest(int(np.sum(values > bound)), values.size, alternative="greater").pvalue)


def below(values: ArrayLike, bound: float) -> float:
    """p of the sign test that the median of ``values`` (n,) is below ``bound``; ties speak against it."""
    return above(-np.asarray(values, dtype=float), -bound)


def interval(values: ArrayLike) -> tuple[float, float]:
    """Bootstrap interval of the median of ``values`` (n,), n >= 2, at 95 % (percentile method)."""
    values = np.asarray(values, dtype=float)
    options = {"method": "percentile", "n_resamples": _RESAMPLES, "confidence_level": CONFIDENCE}
    found = bootstrap((values,), np.median, rng=np.random.default_rng(_SEED), **options)
    low, high = found.confidence_interval
    return float(low), float(high)


def holm(p: ArrayLike) -> NDArray[np.float64]:
    """p values (m,) adjusted for their number by Holm's step-down method, at most 1."""
    p = np.asarray(p, dtype=float)
    order = np.argsort(p)
    stepped = np.maximum.accumulate(p[order] * np.arange(p.size, 0, -1))
    adjusted = np.empty(p.size)
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted


def needed(n: int, level: float, chance: float = 0.5) -> int:
    """Least k out of n that chance exceeds at the level only; n + 1 where none is enough."""
    return int(binom.isf(level, n, chance)) + 1


def smallest_share(n: int, chance: float, level: float) -> float:
    """The share of n replicates that a binomial test would have told from ``chance`` with a power of 80 %.

    Infinite where n replicates are too few for any share.
    """
    k = needed(n, level, chance)
    return float(beta.ppf(POWER, k, n - k + 1)) if k <= n else float("inf")


def smallest_effect(effects: ArrayLike, level: float) -> float:
    """The median effect that a sign test would have told from nothing with a power of 80 %.

    The effects that were found, moved as a whole, stand for those of another experiment.

    Args:
        effects: d, (n,).
        level: alpha.

    Returns:
        Infinite where n replicates are too few for any effect.
    """
    effects = np.asarray(effects, dtype=float)
    share = smallest_share(effects.size, 0.5, level)  # of replicates on the right side
    if not np.isfinite(share):
        return float("inf")
    return float(-np.quantile(effects - np.median(effects), 1.0 - share))


def smallest_margin(differences: ArrayLike, level: float) -> float:
    """The narrowest band round 0 that sign tests would have found the median of (n,) values to lie in."""
    ordered = np.sort(np.asarray(differences, dtype=float))
    k = needed(ordered.size, level)
    if k > ordered.size:
        return float("inf")
    return float(max(ordered[k - 1], -ordered[-k]))
