"""What rliable (Agarwal et al. 2021) recommends for few runs: numbers that a lucky run does not decide.

A score table is (tasks, runs): a task is a place, a run is a test mission. Small is good here: errors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata, trim_mean

Table = NDArray[np.float64]


def interquartile_mean(scores: Table) -> NDArray[np.float64]:
    """Mean of the middle half of all scores, (..., tasks, runs) -> (...)."""
    return trim_mean(scores.reshape(*scores.shape[:-2], -1), 0.25, axis=-1)


def bootstrap(scores: Table, rng: np.random.Generator, draws: int = 2000) -> tuple[float, float]:
    """95 % interval of the interquartile mean, runs drawn again within each task (stratified bootstrap).

    Args:
        scores: (tasks, runs).
        rng: what is drawn from.
        draws: how many.
    """
    return _interval(interquartile_mean(_again(scores, _runs(scores, rng, draws))))


def bootstrap_ratio(
    scores: Table, others: Table, rng: np.random.Generator, draws: int = 2000
) -> tuple[float, float]:
    """95 % interval of the ratio of interquartile means, the same runs of both drawn again.

    Args:
        scores: (tasks, runs).
        others: of the same tasks and runs, (tasks, runs).
        rng: what is drawn from.
        draws: how many.
    """
    runs = _runs(scores, rng, draws)
    return _interval(interquartile_mean(_again(scores, runs)) / interquartile_mean(_again(others, runs)))


def _runs(scores: Table, rng: np.random.Generator, draws: int) -> NDArray[np.int64]:
    return rng.integers(scores.shape[1], size=(draws, *scores.shape))


def _again(scores: Table, runs: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.take_along_axis(scores[None], runs, axis=2)


def _interval(found: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.quantile(found, [0.025, 0.975])
    return float(low), float(high)


def performance_profile(scores: Table, thresholds: ArrayLike) -> NDArray[np.float64]:
    """Share of runs whose score is at most each threshold (k,), mean over tasks, (k,)."""
    return (scores[..., None] <= np.asarray(thresholds)).mean(axis=(0, 1))


def probability_of_improvement(scores: Table, others: Table) -> float:
    """Chance that a run is better (less) than another's, ties counting half, mean over tasks.

    By the Mann-Whitney statistic.
    """
    return float(np.mean([_beats(one, other) for one, other in zip(scores, others, strict=True)]))


def _beats(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    n, m = len(one), len(other)
    ranks = rankdata(np.concatenate([one, other]))[:n]
    return 1.0 - (ranks.sum() - n * (n + 1) / 2) / (n * m)
