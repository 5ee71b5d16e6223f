"""The statistics of the contest against their definitions."""

import numpy as np
import pytest

from fieldrl.core.streams import stream
from pipelines.contest.statistics import (
    bootstrap,
    bootstrap_ratio,
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
)


def test_the_interquartile_mean_forgets_the_outer_quarters():
    assert interquartile_mean(np.array([[0.0, 1.0, 2.0, 1e9]])) == 1.5


def test_a_profile_counts_runs():
    scores = np.array([[1.0, 2.0], [3.0, 4.0]])
    assert np.array_equal(performance_profile(scores, [0.5, 2.0, 4.0]), [0.0, 0.5, 1.0])


def test_improvement_is_counted_pair_by_pair():
    one, other = np.array([[1.0, 3.0, 3.0]]), np.array([[2.0, 3.0]])
    pairs = [1.0 if a < b else 0.5 if a == b else 0.0 for a in one[0] for b in other[0]]
    assert probability_of_improvement(one, other) == pytest.approx(np.mean(pairs))
    assert probability_of_improvement(one, one) == pytest.approx(0.5)


def test_the_bootstrap_covers_the_mean_of_normal_scores():
    rng, hits = stream(0, "test"), 0
    for _ in range(60):
        low, high = bootstrap(rng.normal(size=(2, 30)), rng, 200)
        hits += low <= 0.0 <= high
    assert 50 <= hits <= 60


def test_runs_are_drawn_within_their_task():
    table = np.array([[0.0, 0.0], [1.0, 1.0]])
    low, high = bootstrap(table, stream(0, "test"), 50)
    assert low == high == 0.5


def test_a_ratio_is_that_of_the_same_runs():
    others = stream(0, "test").gamma(2.0, size=(2, 40))
    assert bootstrap_ratio(2.0 * others, others, stream(1, "test"), 50) == (2.0, 2.0)
    low, high = bootstrap_ratio(others[:, ::-1], others, stream(1, "test"), 500)
    assert low < 0.95 < 1.05 < high
