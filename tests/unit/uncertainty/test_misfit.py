"""Tests of residuals."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.stats import chi2

from fieldrl.uncertainty.misfit import _exact, misfit

RNG = np.random.default_rng(0)


def residuals(n, count, slopes):
    """Residuals of linear fits to normal noise, (count, n)."""
    noise = RNG.standard_normal((count, n))
    return noise - noise @ slopes @ np.linalg.inv(slopes.T @ slopes) @ slopes.T


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("n", [4, 5, 10, 20])
def test_a_true_model_is_blamed_in_at_most_five_of_a_hundred(n, known):
    slopes = 50 * RNG.standard_normal((n, 2))
    alarms = [misfit(z, slopes, known).wrong for z in residuals(n, 1000, slopes)]
    assert 0.01 <= np.mean(alarms) <= 0.075


def test_known_noise_gives_false_alarms_near_five_of_a_hundred_from_three_samples_on():
    for n in (3, 5, 20):
        slopes = 50 * RNG.standard_normal((n, 2))
        alarms = [misfit(z, slopes, True).wrong for z in residuals(n, 2000, slopes)]
        assert 0.03 <= np.mean(alarms) <= 0.07


def test_few_signs_say_nothing_of_runs():
    slopes = 50 * RNG.standard_normal((5, 2))
    assert np.isnan(misfit(np.array([1.0, 1.0, 1.0, -1.0, -1.0]), slopes, True).p_runs)
    slopes = 50 * RNG.standard_normal((12, 2))
    assert misfit(np.repeat([1.0, -1.0], 6), slopes, True).p_runs < 0.01


def test_chi_square_is_that_of_the_residuals():
    slopes = 50 * RNG.standard_normal((12, 2))
    z = residuals(12, 1, slopes)[0]
    found = misfit(z, slopes, True)
    assert found.expected == pytest.approx(10.0, abs=0.01)
    assert found.p_large == pytest.approx(chi2.sf(z @ z, 10), rel=0.01)
    assert found.p_small == pytest.approx(chi2.cdf(z @ z, 10), rel=0.01)


def test_runs_are_counted_as_by_enumeration():
    for a, b in ((3, 4), (5, 2)):
        counts = [
            1 + sum(x != y for x, y in itertools.pairwise(row))
            for row in set(itertools.permutations([1] * a + [0] * b))
        ]
        for runs in range(2, a + b + 1):
            assert _exact(a, b, runs) == pytest.approx(np.mean(np.array(counts) <= runs), rel=1e-9)


def test_each_kind_of_error_is_seen_by_its_test():
    slopes = 50 * RNG.standard_normal((40, 2))
    z = residuals(40, 1, slopes)[0]
    drift = misfit(np.abs(z) * np.where(np.arange(40) < 20, 1, -1), slopes, True)
    assert drift.wrong
    assert drift.p_runs < 1e-6
    assert drift.p <= 3 * drift.p_runs
    z[7] = 6.0
    off = misfit(z, slopes, True)
    assert off.wrong
    assert off.outlier == 7
    assert misfit(2.0 * residuals(40, 1, slopes)[0], slopes, True).p_large < 0.001
    assert misfit(0.3 * residuals(40, 1, slopes)[0], slopes, True).p_small < 0.001


def test_paths_are_tested_apart():
    slopes, signs = 50 * RNG.standard_normal((40, 2)), np.where(np.arange(40) % 10 < 5, 1.0, -1.0)
    assert misfit(signs, slopes, True, np.arange(40) // 10).p_runs < 1e-4
    alternating = np.where(np.arange(40) % 2, 1.0, -1.0)
    assert misfit(alternating, slopes, True, np.arange(40) // 10).p_runs > 0.9


def test_residuals_of_nothing_say_nothing():
    assert not misfit(np.empty(0), np.empty((0, 2)), True).wrong
    assert not misfit(np.zeros(3), np.eye(3, 2), False).wrong
