"""The least-squares estimator as a component: bounds, memo, corner cases."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.core.samples import Samples
from fieldrl.estimator.descent.normal_equations import _sum, _sum_two
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import Fit, FitProblem, errors
from fieldrl.pde.advection import Advection
from fieldrl.pde.initial import InitialFeature
from pipelines.benchmarks.global_minimum import random_problem

MODEL = Advection()


def same(one: Fit, other: Fit) -> bool:
    """Bit for bit."""
    arrays = (one.theta, other.theta), (one.loss, other.loss), (one.residuals, other.residuals)
    return all(a.tobytes() == b.tobytes() for a, b in arrays)


def noiseless(n: int, b=(5.0, 5.0), model: Advection = MODEL) -> Samples:
    positions = np.random.default_rng(n).uniform(20, 160, (n, 2))
    times = np.arange(1.0, n + 1)
    return Samples.of(positions, times, model.predict(np.array([b]), positions, times)[0])


@pytest.mark.parametrize("n", [4, 12, 20])
def test_without_noise_or_penalty_every_fold_finds_the_truth(n):
    samples = noiseless(n, (3.0, 4.0))
    fit = LeastSquares(tikhonov=0.0).fit(FitProblem(MODEL, samples, 0.0))
    np.testing.assert_allclose(fit.theta, np.tile((3.0, 4.0), (n + 1, 1)), atol=1e-5)
    assert errors(fit).e_total < 1e-8


@pytest.mark.parametrize("estimator", [LeastSquares(), LeastSquares(starts=1)], ids=["global", "local"])
@pytest.mark.parametrize("number", range(12))
def test_reported_losses_and_residuals_belong_to_the_reported_theta(estimator, number):
    problem = random_problem(number)
    fit = estimator.fit(problem)
    residuals = problem.residuals(fit.theta)
    np.testing.assert_allclose(fit.residuals, residuals, rtol=1e-5, atol=2e-5)
    losses = problem.losses(residuals, fit.theta)
    np.testing.assert_allclose(fit.loss, np.diagonal(losses), rtol=1e-6, atol=1e-9)
    assert fit.evaluations >= problem.folds


def test_with_one_sample_its_fold_predicts_with_the_centre_of_the_bounds():
    model = Advection(lower=(-10.0, 0.0), upper=(20.0, 12.0))
    samples = Samples.of([[60.0, 55.0]], [1.0], [80.0])
    for estimator in (LeastSquares(), LeastSquares(starts=1)):
        fit = estimator.fit(FitProblem(model, samples))
        np.testing.assert_allclose(fit.theta[1], (5.0, 6.0), atol=1e-6)
        centre = model.predict(np.array([[5.0, 6.0]]), samples.positions, samples.times)[0, 0] - 80.0
        assert errors(fit).e_cv == pytest.approx(centre**2, rel=1e-6)
        assert fit.loss[1] == pytest.approx(0.0, abs=1e-12)


def test_equal_samples_give_equal_folds():
    samples = Samples.of(np.full((6, 2), 60.0), np.full(6, 3.0), np.full(6, 70.0))
    fit = LeastSquares().fit(FitProblem(MODEL, samples))
    np.testing.assert_allclose(fit.loss, fit.loss[0], rtol=1e-4)
    assert errors(fit).e_total < 1e-3


def test_samples_that_see_nothing_leave_the_estimate_at_the_centre():
    samples = Samples.of(np.full((5, 2), 1e5), np.arange(1.0, 6.0), np.zeros(5))
    fit = LeastSquares().fit(FitProblem(MODEL, samples))
    np.testing.assert_allclose(fit.theta, 0.0, atol=1e-5)
    assert errors(fit).e_total == 0.0


@pytest.mark.parametrize("estimator", [LeastSquares(), LeastSquares(starts=1)], ids=["global", "local"])
@pytest.mark.parametrize("b", [(9.0, 9.0), (9.0, 0.0), (-9.0, 2.0)])
def test_a_truth_beyond_the_bounds_leaves_the_estimate_within_them(estimator, b):
    model = Advection(true=(0.0, 0.0), lower=(-4.0, -4.0), upper=(4.0, 4.0))
    fit = estimator.fit(FitProblem(model, noiseless(12, b, model)))
    assert np.all(fit.theta >= -4.0)
    assert np.all(fit.theta <= 4.0)


def test_a_truth_just_beyond_a_bound_leaves_the_estimate_on_it():
    model = Advection(true=(0.0, 0.0), lower=(-6.0, -6.0), upper=(6.0, 6.0))
    fit = LeastSquares().fit(FitProblem(model, noiseless(20, (6.5, 3.0), model)))
    np.testing.assert_allclose(fit.theta[:, 0], 6.0, atol=1e-9)
    np.testing.assert_allclose(fit.theta[:, 1], 3.0, atol=0.5)


def test_a_fresh_estimator_and_one_that_has_seen_other_samples_agree_bit_for_bit():
    seasoned = LeastSquares()
    for number in (0, 7, 2, 7, 7, 30, 1):
        problem = random_problem(number)
        assert same(seasoned.fit(problem), LeastSquares().fit(problem))


def test_a_growing_episode_and_its_last_problem_alone_agree_bit_for_bit():
    growing, whole = LeastSquares(), random_problem(4).samples
    for n in range(1, len(whole) + 1):
        part = Samples.of(whole.positions[:n], whole.times[:n], whole.values[:n])
        assert same(growing.fit(FitProblem(MODEL, part)), LeastSquares().fit(FitProblem(MODEL, part)))


@pytest.mark.parametrize("n", [1, 3, 20, 80], ids="n = {}".format)
def test_fold_0_is_the_same_with_the_other_folds_and_without(n):
    positions, times = np.random.default_rng(n).uniform(0, 100, (n, 2)), np.arange(1.0, n + 1)
    values = MODEL.predict(np.array([[2.0, 3.0]]), positions, times)[0]
    samples = Samples.of(positions, times, values + np.random.default_rng(1).standard_normal(n))
    whole = LeastSquares().fit(FitProblem(MODEL, samples))
    alone = LeastSquares().fit(FitProblem(MODEL, samples, leave_one_out=False))
    assert alone.theta.shape == (1, 2)
    assert alone.evaluations < whole.evaluations
    for found, every in ((alone.theta, whole.theta), (alone.residuals, whole.residuals)):
        np.testing.assert_array_equal(found[0], every[0])


def test_one_changed_value_amid_known_samples_is_noticed():
    estimator, whole = LeastSquares(), random_problem(4).samples
    estimator.fit(FitProblem(MODEL, whole))
    values = whole.values.copy()
    values[1] += 0.5
    changed = FitProblem(MODEL, Samples.of(whole.positions, whole.times, values))
    assert same(estimator.fit(changed), LeastSquares().fit(changed))


def test_another_model_is_not_taken_for_the_last_one():
    estimator, samples = LeastSquares(), random_problem(4).samples
    estimator.fit(FitProblem(MODEL, samples))
    for model in (Advection(InitialFeature(scale=20.0)), Advection(lower=(0.0, 0.0))):
        problem = FitProblem(model, samples)
        assert same(estimator.fit(problem), LeastSquares().fit(problem))


def test_more_samples_than_the_memo_has_room_for_are_fitted():
    samples = noiseless(70)
    fit = LeastSquares().fit(FitProblem(MODEL, samples))
    assert fit.theta.shape == (71, 2)
    np.testing.assert_allclose(fit.theta, 5.0, atol=1e-3)


def test_a_pickled_estimator_fits_the_same():
    problem, estimator = random_problem(4), LeastSquares()
    estimator.fit(problem)
    assert same(pickle.loads(pickle.dumps(LeastSquares())).fit(problem), estimator.fit(problem))


@pytest.mark.parametrize("starts", [1, 4])
def test_thousands_of_pooled_samples_tell_the_flow_within_its_standard_error(starts):
    rng, n = np.random.default_rng(0), 4000
    times = rng.integers(1, 21, n).astype(float)
    positions = (50.0, 50.0) + 5.0 * times[:, None] + rng.normal(0, 30, (n, 2))
    b = np.array([[5.0, 5.0]])
    values = MODEL.predict(b, positions, times)[0] + rng.standard_normal(n)
    slopes = MODEL.jacobian(b, positions, times)[0]
    deviation = np.sqrt(np.diagonal(np.linalg.inv(slopes.T @ slopes)))
    problem = FitProblem(MODEL, Samples.of(positions, times, values), leave_one_out=False)
    fit = LeastSquares(starts=starts).fit(problem)
    assert fit.theta.shape == (1, 2)
    assert np.all(np.abs(fit.theta[0] - 5.0) < 4 * deviation)
    assert fit.loss[0] == pytest.approx(1.0, abs=0.1)


def test_one_start_descends_all_folds_from_the_centre_even_where_that_fails():
    failed = 0
    for number in range(0, 60, 2):
        problem = random_problem(number)
        local, best = (LeastSquares(starts=starts).fit(problem) for starts in (1, 4))
        assert np.all(local.loss >= best.loss * (1 - 1e-6) - 1e-9)
        failed += local.loss[0] > 2 * best.loss[0] + 1.0
    assert failed > 0


def test_a_model_without_compiled_derivatives_is_fitted_by_differences():
    class Plain:
        parameters, predict, field = MODEL.parameters, staticmethod(MODEL.predict), staticmethod(MODEL.field)

    samples = noiseless(6)
    fit = LeastSquares().fit(FitProblem(Plain(), samples))
    compiled = LeastSquares().fit(FitProblem(MODEL, samples))
    assert fit.theta[0] == pytest.approx(compiled.theta[0], abs=1e-2)
    assert fit.course is not None


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("starts", 0),
        ("starts", 1.5),
        ("grid", 2),
        ("tikhonov", -1e-3),
        ("tikhonov", float("nan")),
        ("iterations", 0),
        ("tolerance", 0.0),
    ],
)
def test_a_bad_value_is_refused_by_its_name(key, value):
    with pytest.raises(InvalidValue) as error:
        LeastSquares(**{key: value})
    assert error.value.key == key


def test_sums_for_two_unknowns_equal_the_general_ones():
    rng = np.random.default_rng(0)
    residuals, jacobian, weights = rng.normal(size=7), rng.normal(size=(7, 2)), rng.uniform(size=7)
    sums = [(np.zeros((2, 2)), np.zeros(2)) for _ in range(2)]
    for add, found in zip((_sum, _sum_two), sums, strict=True):
        add(residuals, jacobian, weights, *found)
    np.testing.assert_allclose(sums[0][0], sums[1][0], rtol=1e-13)
    np.testing.assert_allclose(sums[0][1], sums[1][1], rtol=1e-13)
