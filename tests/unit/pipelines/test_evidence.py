"""Sign tests, Holm, intervals and what would have been seen: against SciPy, by counting, by chance."""

import numpy as np
import pytest
from scipy.stats import binom, norm

from pipelines.paper import evidence


def test_the_sign_test_counts_replicates_beyond_the_bound_and_ties_speak_against():
    values = np.array([1.0, 2.0, 3.0, 0.0, -1.0, 0.0, 5.0, 6.0])
    assert evidence.above(values, 0.0) == pytest.approx(binom.sf(4, 8, 0.5))
    assert evidence.below(values, 0.0) == pytest.approx(binom.sf(0, 8, 0.5))
    assert evidence.above(np.zeros(8), 0.0) == evidence.below(np.zeros(8), 0.0) == 1.0


def test_holm_gives_the_textbook_values_in_the_order_of_the_tests():
    np.testing.assert_allclose(evidence.holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])
    np.testing.assert_allclose(evidence.holm([0.5, 0.9]), [1.0, 1.0])
    assert evidence.holm([]).size == 0


@pytest.mark.parametrize("n", [2, 5, 8, 20, 64])
@pytest.mark.parametrize("level", [0.05, 0.001])
def test_the_count_that_is_needed_is_the_least_that_the_level_accepts(n, level):
    k = evidence.needed(n, level)
    assert binom.sf(k - 1, n, 0.5) <= level
    assert k == 0 or binom.sf(k - 2, n, 0.5) > level


def test_the_interval_holds_the_median_of_most_samples():
    rng, held = np.random.default_rng(0), 0
    for _ in range(60):
        low, high = evidence.interval(rng.exponential(size=40))
        held += low <= np.log(2) <= high
    assert held >= 51


def test_the_smallest_effect_is_found_in_four_of_five_experiments():
    rng, level = np.random.default_rng(1), 0.001
    effect = evidence.smallest_effect(norm.ppf((np.arange(64) + 0.5) / 64), level)
    found = [evidence.above(rng.normal(effect, 1, 64), 0.0) <= level for _ in range(400)]
    assert 0.74 < np.mean(found) < 0.88


def test_the_smallest_margin_is_one_that_both_tests_accept_and_no_narrower_one_is():
    values, level = np.random.default_rng(2).normal(0.2, 1.0, 30), 0.01

    def within(margin):
        return max(evidence.above(values, -margin), evidence.below(values, margin)) <= level

    margin = evidence.smallest_margin(values, level)
    assert within(margin * (1 + 1e-9))
    assert not within(margin * (1 - 1e-6))


def test_the_smallest_share_is_found_in_four_of_five_experiments():
    k, share = evidence.needed(64, 0.001, 0.05), evidence.smallest_share(64, 0.05, 0.001)
    assert binom.sf(k - 1, 64, share) == pytest.approx(0.8)
    assert evidence.smallest_share(2, 0.5, 0.001) == np.inf


def test_two_replicates_show_nothing_however_large():
    assert evidence.smallest_effect([5.0, 5.0], 0.05) == evidence.smallest_margin([0.0, 0.0], 0.05) == np.inf
