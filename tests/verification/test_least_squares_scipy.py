"""The fits against SciPy: same minima, same errors, never a worse loss."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares, minimize

from fieldrl.core.samples import Samples
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem, errors
from pipelines.benchmarks.global_minimum import compare, descend, multistart, random_problem, subject

MODEL, _ = subject()
CENTRE, HALF = MODEL.parameters.centre, MODEL.parameters.half_width


def drifting_problem(seed: int, n: int) -> FitProblem:
    """Samples scattered round the drifting feature: every fold is well determined."""
    rng, times = np.random.default_rng(seed), np.arange(1.0, n + 1)
    positions = (50.0, 50.0) + 5.0 * times[:, None] + rng.uniform(-35, 35, (n, 2))
    clean = MODEL.predict(np.array([[5.0, 5.0]]), positions, times)[0]
    return FitProblem(MODEL, Samples.of(positions, times, clean + rng.standard_normal(n)))


@pytest.mark.parametrize("n", [4, 6, 9, 13, 16, 20])
def test_every_fold_agrees_with_scipy_to_a_millionth(n):
    for seed in range(4):
        problem = drifting_problem(100 * n + seed, n)
        fit = LeastSquares().fit(problem)
        for fold in range(n + 1):
            theta, loss = descend(problem, fold, (fit.theta[fold] - CENTRE) / HALF)
            assert fit.loss[fold] == pytest.approx(loss, rel=1e-9)
            np.testing.assert_allclose(fit.theta[fold], theta, rtol=0, atol=1e-6)


@pytest.mark.parametrize("starts", [1, 4])
def test_the_minimum_is_where_the_gradient_of_the_loss_vanishes(starts):
    for seed in range(6):
        problem = drifting_problem(seed, 12)
        fit = LeastSquares(starts=starts).fit(problem)
        u = (fit.theta - CENTRE) / HALF
        slopes = MODEL.jacobian(fit.theta, problem.samples.positions, problem.samples.times) * HALF
        residuals = problem.residuals(fit.theta)
        gradient = np.einsum("fj,fj,fjk->fk", problem.weights, residuals, slopes) + problem.tikhonov * u
        curvature = np.einsum("fj,fjk->fk", problem.weights, slopes**2)
        inside = np.all(np.abs(u) < 1.0, axis=1)
        assert inside.any()
        assert np.abs(gradient / curvature)[inside].max() < 1e-6


def brute_force(problem: FitProblem, kept: Samples) -> np.ndarray:
    """The minimiser of Eq. (3) with the Tikhonov term over some samples: a scan, then Nelder-Mead."""

    def loss(theta):
        pull = problem.tikhonov * np.sum(((theta - CENTRE) / HALF) ** 2)
        if not len(kept):
            return pull
        misfit = MODEL.predict(theta[None], kept.positions, kept.times)[0] - kept.values
        return np.mean(misfit**2) + pull

    axis = np.linspace(-14.5, 14.5, 59)
    scan = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    losses = [loss(theta) for theta in scan]
    options = {"xatol": 1e-9, "fatol": 1e-13, "maxiter": 4000, "maxfev": 4000}
    ends = [minimize(loss, scan[i], method="Nelder-Mead", options=options) for i in np.argsort(losses)[:8]]
    return min(ends, key=lambda end: end.fun).x


@pytest.mark.parametrize("n", [1, 2, 5])
def test_the_errors_are_equations_three_to_seven_by_brute_force(n):
    problem = drifting_problem(n, n)
    data = problem.samples
    found = errors(LeastSquares().fit(problem))

    def squared(theta, i):
        return (
            MODEL.predict(theta[None], data.positions[i : i + 1], data.times[i : i + 1])[0, 0]
            - data.values[i]
        ) ** 2

    full = brute_force(problem, data)
    e_f = np.mean([squared(full, i) for i in range(n)])
    e_cv = np.mean([squared(brute_force(problem, data.without(i)), i) for i in range(n)])
    assert found.e_f == pytest.approx(e_f, rel=1e-5, abs=1e-9)
    assert found.e_cv == pytest.approx(e_cv, rel=1e-5)
    assert found.e_total == found.e_f + found.e_cv


def test_the_tikhonov_term_moves_the_fit_but_is_no_part_of_the_errors():
    data = drifting_problem(3, 8).samples
    strong = FitProblem(MODEL, data, tikhonov=50.0)
    fit = LeastSquares(tikhonov=50.0).fit(strong)
    found = errors(fit)
    misfit = MODEL.predict(fit.theta[:1], data.positions, data.times)[0] - data.values
    assert found.e_f == pytest.approx(np.mean(misfit**2), rel=1e-6)
    assert fit.loss[0] == pytest.approx(found.e_f + strong.penalty(fit.theta[:1])[0], rel=1e-6)
    assert fit.loss[0] - found.e_f > 1.0


def test_one_start_is_what_scipy_finds_from_the_centre_of_the_bounds():
    estimator, agreed = LeastSquares(starts=1), 0
    for seed in range(10):
        problem = drifting_problem(seed, 8)
        fit = estimator.fit(problem)
        for fold in range(9):
            theta, _ = descend(problem, fold, np.zeros(2))
            agreed += np.abs(theta - fit.theta[fold]).max() < 1e-6
    assert agreed > 70


def test_scipy_without_bounds_or_derivatives_finds_the_same_minimum():
    problem = drifting_problem(11, 20)
    data, fit = problem.samples, LeastSquares().fit(problem)

    def residuals(theta):
        misfit = MODEL.predict(theta[None], data.positions, data.times)[0] - data.values
        return np.append(misfit / np.sqrt(20), np.sqrt(problem.tikhonov) * (theta - CENTRE) / HALF)

    found = least_squares(
        residuals, [4.5, 5.5], jac="3-point", method="lm", ftol=1e-15, xtol=1e-15, gtol=1e-15
    )
    np.testing.assert_allclose(fit.theta[0], found.x, rtol=0, atol=1e-6)


def assert_never_worse(numbers, full: bool) -> None:
    rows = [row for number in numbers for row in compare(number, full)]
    assert [row for row in rows if row["verdict"] == "worse"] == []


def test_random_walks_are_never_fitted_worse_than_by_scipy_from_32_starts():
    assert_never_worse(range(20), full=False)


@pytest.mark.slow
def test_more_random_walks_are_never_fitted_worse_than_by_scipy_from_32_starts():
    assert_never_worse(range(40, 50), full=True)


def test_many_starts_of_scipy_find_no_minimum_below_the_full_fit_of_few_samples():
    for number in (n for n in range(200, 300) if len(random_problem(n).samples) in (2, 3)):
        problem = random_problem(number)
        loss = subject()[1].fit(problem).loss[0]
        best = multistart(problem, 0, np.random.default_rng(number), starts=12)[1]
        assert loss <= best * (1 + 1e-6) + 1e-9
