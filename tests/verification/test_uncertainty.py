"""Covariance against a numerical Hessian, profiles against SciPy, on 200 problems each."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from fieldrl.core.samples import Samples
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection
from fieldrl.uncertainty import assess, noise_of

PROBLEMS = 200


def truth(seed):
    return np.random.default_rng(1000 + seed).uniform(-6, 6, 2)


def plume(n, seed, noise=1.0):
    """Samples about a drifting feature."""
    rng, model, true = np.random.default_rng(seed), Advection(), truth(seed)
    times = np.arange(1.0, n + 1)
    positions = 50.0 + times[:, None] * true + rng.uniform(-40, 40, (n, 2))
    values = model.predict(true[None], positions, times)[0] + noise * rng.standard_normal(n)
    return FitProblem(model, Samples.of(positions, times, values), 0.0, False)


def test_covariance_is_the_inverse_of_a_numerical_hessian():
    """Of half the deviance, by differences, where residuals are 0 and Fisher information is the Hessian."""
    worst = 0.0
    for seed in range(PROBLEMS):
        true = truth(seed)
        problem, h = plume(12, seed, noise=0.0), 1e-3
        found = assess(problem, true, noise_of(problem.samples, 1.0))
        shifts = h * np.array([(1, 1), (1, -1), (-1, 1), (-1, -1), (2, 0), (-2, 0), (0, 2), (0, -2), (0, 0)])
        d = 0.5 * np.sum(problem.residuals(true + shifts) ** 2, axis=1)
        mixed = (d[0] - d[1] - d[2] + d[3]) / (4 * h * h)
        hessian = np.array([[(d[4] - 2 * d[8] + d[5]), 0.0], [0.0, d[6] - 2 * d[8] + d[7]]]) / (4 * h * h)
        hessian[0, 1] = hessian[1, 0] = mixed
        expected = np.sqrt(np.diag(np.linalg.inv(hessian)))
        worst = max(worst, float(np.max(np.abs(found.std / expected - 1))))
    assert worst < 0.01


def test_scipy_s_profile_crosses_the_bar_where_an_interval_ends():
    """One per cent of the width inside an end the constrained minimum lies below the bar, outside above."""
    checked = 0
    for seed in range(PROBLEMS):
        problem = plume(12, seed)
        estimate = LeastSquares().fit(problem).theta[0]
        found = assess(problem, estimate, noise_of(problem.samples, 1.0))
        bar = found.least + found.rise
        for k in range(2):
            low, high = found.interval[k]
            for end, inwards in ((low, 1.0), (high, -1.0)):
                shift = 0.01 * inwards * (high - low)
                if abs(end) < 15.0:
                    assert scipy_profile(problem, found, k, end + shift) < bar
                    assert scipy_profile(problem, found, k, end - shift) > bar
                    checked += 1
    assert checked > 780


def scipy_profile(problem, found, k, value):
    """Least deviance with unknown k at ``value``, from the solution nearest to the best."""
    theta = found.solutions[0].copy()
    theta[k] = value
    samples, model = problem.samples, problem.model

    def placed(other):
        theta[1 - k] = other[0]
        return theta[None]

    def residuals(other):
        return problem.residuals(placed(other))[0]

    def slope(other):
        return model.jacobian(placed(other), samples.positions, samples.times)[0, :, 1 - k, None]

    done = least_squares(residuals, theta[1 - k], slope, method="lm", xtol=1e-10, ftol=1e-10)
    return 2 * done.cost
