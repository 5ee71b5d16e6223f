"""Standard deviations, intervals, identifiability and their words."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, norm, t

from fieldrl.core.samples import Samples
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection
from fieldrl.uncertainty import Noise, assess, noise_of, verdict
from tests.unit.uncertainty.fit_problems import Kinked, Line, Opaque, line, nothing_seen, plume


def linear_answer(problem):
    """Estimate, covariance for noise of one, and residual sum of squares, by textbook algebra."""
    samples = problem.samples
    design = np.stack([samples.positions[:, 0], samples.times], axis=1)
    theta, *_ = np.linalg.lstsq(design, samples.values, rcond=None)
    return theta, np.linalg.inv(design.T @ design), float(np.sum((design @ theta - samples.values) ** 2))


@pytest.mark.parametrize("level", [0.5, 0.8, 0.95])
def test_with_known_noise_a_linear_model_has_the_normal_intervals(level):
    problem = line(noise=0.3)
    theta, covariance, _ = linear_answer(problem)
    found = assess(problem, theta, noise_of(problem.samples, 0.3), level=level)
    std = 0.3 * np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(found.std, std, rtol=1e-9)
    half = norm.ppf(0.5 + level / 2) * std
    np.testing.assert_allclose(
        found.interval, np.stack([theta - half, theta + half], axis=1), atol=2e-3 * half.min()
    )


@pytest.mark.parametrize("n", [3, 5, 12])
def test_with_estimated_noise_a_linear_model_has_student_s_intervals(n):
    problem = line(n, noise=0.05, seed=4)
    theta, covariance, rest = linear_answer(problem)
    found = assess(problem, theta, noise_of(problem.samples, None))
    std = np.sqrt(rest / (n - 2) * np.diag(covariance))
    np.testing.assert_allclose(found.std, std, rtol=1e-6)
    half = np.minimum(t.ppf(0.975, n - 2) * std, 10.0)
    expected = np.clip(np.stack([theta - half, theta + half], axis=1), -10.0, 10.0)
    np.testing.assert_allclose(found.interval, expected, atol=3e-3 * half.max())


def test_noise_that_other_residuals_told_has_their_size_and_degrees_of_freedom():
    problem = line(5, noise=0.05, seed=4)
    theta, covariance, _ = linear_answer(problem)
    found = assess(problem, theta, Noise(np.ones(5), False, (0.09, 40)))
    std = 0.3 * np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(found.std, std, rtol=1e-6)
    width = 2 * t.ppf(0.975, 40) * std
    np.testing.assert_allclose(np.diff(found.interval, axis=1)[:, 0], width, rtol=3e-3)


def test_samples_that_state_their_noise_are_believed():
    problem = line(noise=0.3)
    object.__setattr__(problem.samples, "std", np.linspace(0.1, 2.0, 12))
    told = noise_of(problem.samples, 1.0)
    assert told.known
    np.testing.assert_array_equal(told.std, np.linspace(0.1, 2.0, 12))


def test_a_detection_limit_only_says_that_the_field_is_not_above_it():
    positions, times = np.zeros((4, 2)), np.ones(4)
    values, below = np.array([1.0, 1.2, 0.8, 3.0]), np.array([False, False, False, True])
    problem = FitProblem(Line(), Samples.of(positions, times, values, 0.1, below), 0.0, False)
    found = assess(problem, np.array([0.0, 1.0]), noise_of(problem.samples, None))
    np.testing.assert_allclose(
        found.interval[1], 1.0 + np.array([-1, 1]) * 1.96 * 0.1 / np.sqrt(3), atol=1e-3
    )


def test_without_a_sample_left_the_noise_cannot_be_estimated_and_nothing_is_told():
    problem = line(2)
    found = assess(problem, np.zeros(2), noise_of(problem.samples, None))
    np.testing.assert_array_equal(found.interval, [(-10.0, 10.0)] * 2)
    assert not found.identified.any()
    assert "too few samples" in verdict(found)


def test_a_sign_that_is_not_told_gives_two_pieces_and_two_solutions():
    problem = line(20, squared=True, noise=0.1)
    found = assess(problem, np.array([2.026, -0.991]), noise_of(problem.samples, 0.1))
    (negative, positive), b = found.pieces
    np.testing.assert_allclose(negative, (-positive[1], -positive[0]), rtol=5e-3)
    assert len(b) == 1
    assert not found.identified[0]
    assert found.identified[1]
    assert len(found.solutions) == 2
    text = verdict(found)
    assert text.startswith("Two solutions fit: (a, b) = (")
    assert "a is not told by these samples: every value in (-" in text


def test_beside_a_kink_the_standard_deviation_is_that_of_the_interval():
    """Four samples at -0.01 each, noise 1: Fisher's is 1 / 2 there, and 5 / 2 on the other side."""
    samples = Samples.of(np.zeros((4, 2)), np.arange(4.0), np.full(4, -0.01))
    found = assess(FitProblem(Kinked(), samples, 0.0, False), np.array([-0.01]), noise_of(samples, 1.0))
    reach = norm.ppf(0.975) / 2
    np.testing.assert_allclose(found.interval, [[-0.01 - reach, 5 * (reach - 0.01)]], rtol=3e-3)
    np.testing.assert_allclose(found.std, [(6 * reach - 0.04) / norm.ppf(0.975) / 2], rtol=3e-3)


def test_an_estimate_in_the_wrong_minimum_is_told():
    problem = plume(noise=1.0)
    found = assess(problem, np.array([-9.0, 12.0]), noise_of(problem.samples, 1.0))
    assert found.surpassed
    assert "fits better" in verdict(found)
    assert np.all((found.interval[:, 0] < 5.0) & (found.interval[:, 1] > 5.0))


def test_where_nothing_is_seen_nothing_is_told():
    problem = nothing_seen()
    found = assess(problem, np.zeros(2), noise_of(problem.samples, 1.0))
    np.testing.assert_array_equal(found.interval, [(-15.0, 15.0)] * 2)
    assert not found.identified.any()
    assert np.all(np.isinf(found.std))
    assert "b_x is not told by these samples: every value in (-15, 15)" in verdict(found)


def test_without_samples_every_value_fits():
    found = assess(FitProblem(Line(), Samples.none(), 0.0, False), np.zeros(2), Noise(np.empty(0), True))
    np.testing.assert_array_equal(found.interval, [(-10.0, 10.0)] * 2)
    assert not found.identified.any()


def test_a_combination_that_is_known_is_told():
    positions, times = np.zeros((9, 2)), np.linspace(1.0, 1.02, 9)
    positions[:, 0] = 1.0
    model = Line()
    values = model.predict(np.array([[2.0, -1.0]]), positions, times)[0]
    problem = FitProblem(model, Samples.of(positions, times, values), 0.0, False)
    found = assess(problem, np.array([2.0, -1.0]), noise_of(problem.samples, 0.1))
    assert not found.identified.any()
    text = verdict(found)
    assert "a + b is known to 0.03, the other direction to" in text


def test_an_interval_that_ends_at_a_bound_says_so():
    problem = line(12, noise=0.1, true=(9.99, 0.0))
    theta, _, _ = linear_answer(problem)
    found = assess(problem, np.minimum(theta, 10.0), noise_of(problem.samples, 0.1))
    assert found.interval[0, 1] == 10.0
    assert "The interval of a ends at its upper bound 10." in verdict(found)


def test_intervals_by_a_surrogate_and_a_few_solves_are_those_of_the_model():
    problem = plume(15, seed=3)
    fit = LeastSquares().fit(problem)
    noise = noise_of(problem.samples, 1.0)
    exact = assess(problem, fit.theta[0], noise)
    opaque = Opaque(problem.model)
    rng = np.random.default_rng(0)
    solved = fit.theta[0] + exact.std * rng.normal(0, 3.0, (12, 2))
    dear = FitProblem(opaque, problem.samples, 0.0, False)
    found = assess(dear, fit.theta[0], noise, solved=np.vstack([fit.theta[:1], solved]), solves=3)
    assert found.solves <= 3
    assert len(opaque.solved) <= 13 + 3
    width = np.diff(exact.interval, axis=1)
    np.testing.assert_allclose((found.interval - exact.interval) / width, 0.0, atol=0.02)


def test_many_samples_are_searched_by_some_of_them_with_the_same_result():
    parts = [plume(20, seed).samples for seed in range(60)]
    columns = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("positions", "times", "values")
    )
    problem = FitProblem(Advection(), Samples.of(*columns), 0.0, False)
    found = assess(problem, LeastSquares().fit(problem).theta[0], noise_of(problem.samples, 1.0))
    assert found.identified.all()
    np.testing.assert_allclose(np.diff(found.interval, axis=1)[:, 0], 2 * 1.96 * found.std, rtol=0.01)
    assert found.rise == pytest.approx(chi2.ppf(0.95, 1))
