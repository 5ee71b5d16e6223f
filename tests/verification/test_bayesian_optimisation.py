"""Bayesian optimisation: the surrogate against scikit-learn and differences, its use against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

from fieldrl.core.samples import Samples
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.designs import additive_recurrence, cover
from fieldrl.estimator.problem import FitProblem
from fieldrl.estimator.surrogate.improvement import descend, improvement_bound
from fieldrl.estimator.surrogate.predictions import condition, evidence, linearise, predict
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from pipelines.benchmarks import recovery

U = additive_recurrence(20, 2)


def outputs(u: np.ndarray) -> np.ndarray:
    """Three smooth outputs, (k, 3)."""
    x, y = u.T
    return np.stack([10 * np.sin(3 * x + y), 5 * np.exp(-(x**2) - 4 * y**2), 2 * x + x * y], axis=1)


VALUES = outputs(np.array([[0.23, -0.41]]))[0]
SURROGATE = condition(evidence(U, outputs(U), VALUES))
ELSEWHERE = cover(6, 2)


def test_it_interpolates_its_solves_without_doubt():
    mean, deviation = predict(SURROGATE, np.array(U))
    np.testing.assert_allclose(mean, outputs(U), atol=1e-3)
    assert deviation.max() < 0.01


@pytest.mark.parametrize("j", range(3))
def test_mean_and_deviation_are_those_of_scikit_learn_with_the_same_kernel(j):
    kernel = ConstantKernel(SURROGATE.variance[j], "fixed") * RBF(1 / SURROGATE.inverse_scales[j], "fixed")
    process = GaussianProcessRegressor(kernel, alpha=1e-10 * SURROGATE.variance[j], optimizer=None)
    process.fit(U, outputs(U)[:, j] - SURROGATE.mean[j])
    mean, deviation = process.predict(ELSEWHERE, return_std=True)
    ours = predict(SURROGATE, np.array(ELSEWHERE))
    np.testing.assert_allclose(ours[0][:, j], mean + SURROGATE.mean[j], rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(ours[1][:, j], deviation, rtol=2e-2, atol=1e-3)


def test_its_slopes_are_those_of_differences():
    mean, slope, u = np.empty(3), np.empty((3, 2)), np.array([0.31, -0.17])
    linearise(SURROGATE, u, mean, slope)
    for q in range(2):
        step = 1e-5 * np.eye(2)[q]
        ahead, behind = predict(SURROGATE, np.array([u + step, u - step]))[0]
        np.testing.assert_allclose(slope[:, q], (ahead - behind) / 2e-5, rtol=1e-4, atol=1e-4)


def test_what_it_says_of_unseen_points_is_right_about_as_often_as_it_claims():
    mean, deviation = predict(SURROGATE, np.array(ELSEWHERE))
    assert np.mean(np.abs(outputs(ELSEWHERE) - mean) < 3 * deviation) > 0.95


def test_caution_doubts_more():
    cautious = condition(evidence(U, outputs(U), VALUES), caution=3.0)
    assert np.median(predict(cautious, ELSEWHERE)[1]) > np.median(predict(SURROGATE, ELSEWHERE)[1])


def test_the_bound_lies_above_the_expected_improvement():
    few = condition(evidence(np.array(U[:8]), outputs(U[:8]), VALUES))
    mean, deviation = predict(few, np.array(ELSEWHERE))
    draws = np.random.default_rng(0).standard_normal((1, 40000, 3))
    losses = np.mean((mean[:, None] + deviation[:, None] * draws - VALUES) ** 2, axis=2)
    gains = np.maximum(20.0 - 1e-3 * np.sum(ELSEWHERE**2, axis=1)[:, None] - losses, 0.0).mean(axis=1)
    bound, _ = improvement_bound(few, np.array(ELSEWHERE), VALUES, 1e-3, 20.0)
    assert np.all(bound >= 0.98 * gains)
    assert np.all(bound <= 20.0)


def test_samples_that_repeat_others_hide_no_basin():
    bounds = []
    for copies in (2, 20):
        seen = evidence(np.array(U[:8]), np.tile(outputs(U[:8]), copies), np.tile(VALUES, copies))
        found, _ = improvement_bound(condition(seen), np.array(ELSEWHERE), np.tile(VALUES, copies), 1e-3, 0.1)
        bounds.append(found.sum())
    assert bounds[1] > 1e-4 * bounds[0]


@pytest.mark.parametrize("number", [95, 162])
def test_a_basin_is_found_among_sixty_samples_of_three_unknowns(number):
    kind = ("double_gyre", "flow scaled")
    assert max(recovery.tried(recovery.kinds()[kind](), kind, number)["errors"]) < 3


def test_descent_on_the_surrogate_ends_at_the_minimum_of_its_mean():
    u, weights = np.array([0.3, -0.3]), np.full(3, 1 / 3)
    loss = descend(SURROGATE, VALUES, weights, 1e-3, u, 40)
    near = np.clip(u + 0.05 * ELSEWHERE, -1, 1)
    losses = np.mean((predict(SURROGATE, near)[0] - VALUES) ** 2, axis=1) + 1e-3 * np.sum(near**2, axis=1)
    assert loss <= losses.min() + 1e-9
    np.testing.assert_allclose(u, [0.23, -0.41], atol=0.02)


@pytest.fixture(scope="module")
def gyre():
    return AdvectionDiffusion(cells=(72, 36), order=5)


@pytest.mark.filterwarnings("ignore::fieldrl.pde.finite_volumes.resolution.CoarseGrid")
@pytest.mark.parametrize("seed", range(3))
def test_the_double_gyre_is_fitted_below_the_loss_of_the_truth_in_few_solves(gyre, seed):
    rng, parameters = np.random.default_rng(seed), gyre.parameters
    theta = parameters.centre + parameters.half_width * rng.uniform(-0.5, 0.5, 2)
    positions, times = rng.uniform((20, 10), (140, 90), (10, 2)), np.arange(1.0, 11.0)
    values = gyre.predict(theta[None], positions, times)[0] + rng.standard_normal(10)
    problem = FitProblem(gyre, Samples.of(positions, times, values), leave_one_out=False)
    fit = Composite().fit(problem)
    at_truth = problem.losses(problem.residuals(theta[None]), theta[None])[0, 0]
    assert fit.loss[0] <= at_truth
    assert fit.evaluations <= 30
