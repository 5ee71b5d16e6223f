"""The fit problem: folds, losses, penalty, errors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import Fit, FitProblem, Optimisation, errors, fold_weights
from fieldrl.pde.advection import Advection

MODEL = Advection(lower=(-10.0, 0.0), upper=(20.0, 10.0))
sizes = st.integers(1, 30)


def samples(n: int, seed: int = 0) -> Samples:
    rng = np.random.default_rng(seed)
    return Samples.of(rng.uniform(20, 120, (n, 2)), np.arange(1.0, n + 1), rng.uniform(0, 100, n))


def candidates(m: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(MODEL.parameters.lower, MODEL.parameters.upper, (m, 2))


@given(sizes)
def test_the_weights_of_every_fold_with_samples_sum_to_one(n):
    weights, with_samples = fold_weights(n, True), np.full(n + 1, 1.0)
    with_samples[1:] = float(n > 1)
    np.testing.assert_allclose(weights.sum(axis=1), with_samples, atol=1e-12)


@given(sizes)
def test_a_left_out_sample_has_no_weight_and_the_others_have_the_same(n):
    weights = fold_weights(n, True)
    assert weights.shape == (n + 1, n)
    assert not np.any(np.diagonal(weights[1:]))
    assert np.all(weights[0] == 1 / n)
    assert np.all(weights[1:][~np.eye(n, dtype=bool)] == 1 / max(n - 1, 1))


@given(sizes)
def test_without_leave_one_out_there_is_one_fold_with_all_samples(n):
    problem = FitProblem(MODEL, samples(n), leave_one_out=False)
    assert problem.folds == 1
    assert problem.weights.tolist() == [[1 / n] * n]


def test_the_kept_weights_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        fold_weights(3, True)[0, 0] = 2.0


def test_no_samples_make_one_fold_of_nothing():
    problem = FitProblem(MODEL, Samples.none())
    assert problem.folds == 1
    assert problem.weights.shape == (1, 0)


@given(sizes, st.floats(0, 10))
def test_one_prediction_gives_what_each_fold_computes_on_its_own(n, tikhonov):
    data, theta = samples(n), candidates(4)
    problem = FitProblem(MODEL, data, tikhonov)
    losses = problem.losses(problem.residuals(theta), theta)
    assert losses.shape == (4, n + 1)
    for i in range(4):
        pull = tikhonov * (((theta[i, 0] - 5) / 15) ** 2 + ((theta[i, 1] - 5) / 5) ** 2)
        for fold in range(n + 1):
            kept = data if fold == 0 else data.without(fold - 1)
            misfit = MODEL.predict(theta[i : i + 1], kept.positions, kept.times)[0] - kept.values
            mean = np.mean(misfit**2) if len(kept) else 0.0
            assert losses[i, fold] == pytest.approx(mean + pull, rel=1e-12)


def test_the_penalty_is_zero_at_the_centre_and_tau_at_the_middle_of_a_face():
    problem = FitProblem(MODEL, samples(3), tikhonov=0.5)
    theta = np.array([[5.0, 5.0], [20.0, 5.0], [5.0, 0.0], [20.0, 10.0]])
    np.testing.assert_allclose(problem.penalty(theta), [0.0, 0.5, 0.5, 1.0])


def test_residuals_are_prediction_minus_value():
    data, theta = samples(3), candidates(2)
    expected = MODEL.predict(theta, data.positions, data.times) - data.values
    np.testing.assert_array_equal(FitProblem(MODEL, data).residuals(theta), expected)


def fit_of(residuals) -> Fit:
    residuals = np.array(residuals, dtype=float)
    return Fit(np.zeros((len(residuals), 2)), np.zeros(len(residuals)), residuals, 0, np.empty((0, 2)))


def test_errors_by_hand():
    found = errors(fit_of([[1.0, -2.0, 3.0], [4.0, 9.0, 9.0], [9.0, -5.0, 9.0], [9.0, 9.0, 6.0]]))
    assert found.e_f == pytest.approx((1 + 4 + 9) / 3)
    assert found.e_cv == pytest.approx((16 + 25 + 36) / 3)
    assert found.e_total == pytest.approx(found.e_f + found.e_cv)


def test_errors_of_nothing_are_refused():
    with pytest.raises(ValueError, match="at least one sample"):
        errors(fit_of(np.empty((1, 0))))


def test_fold_0_alone_says_nothing_of_cross_validation():
    found = errors(fit_of([[1.0, 3.0]]))
    assert found.e_f == pytest.approx(5.0)
    assert np.isnan([found.e_cv, found.e_total]).all()


def test_the_best_loss_so_far_passes_over_failed_solves():
    course = Optimisation(np.zeros((5, 2)), np.array([np.nan, 3.0, np.nan, 5.0, 1.0]))
    assert course.best.tolist() == [np.inf, 3.0, 3.0, 3.0, 1.0]
