"""Draws of the unknowns, and the spread of the field that follows from them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest, norm, t

from fieldrl.core.domain import Domain
from fieldrl.uncertainty import Noise, assess, draws, field_std, noise_of
from tests.unit.uncertainty.fit_problems import Opaque, line, nothing_seen, plume
from tests.unit.uncertainty.test_assessment import linear_answer

GRID = Domain((0.0, 0.0), (200.0, 200.0)).grid(20, 20)


@pytest.mark.parametrize("known", [True, False])
def test_draws_of_a_linear_model_are_normal_or_student_s(known):
    problem = line(6, noise=0.3)
    theta, covariance, rest = linear_answer(problem)
    found = draws(assess(problem, theta, Noise(np.full(6, 0.3), known)), 400) * 10.0
    std = np.sqrt(np.diag(covariance)) * (0.3 if known else np.sqrt(rest / 4))
    for k in range(2):
        expected = norm if known else t(4)
        assert kstest((found[:, k] - theta[k]) / std[k], expected.cdf).statistic < 0.06


def test_where_nothing_is_told_draws_fill_the_bounds():
    problem = nothing_seen()
    found = draws(assess(problem, np.zeros(2), noise_of(problem.samples, 1.0)), 400)
    assert np.abs(found).max() <= 1.0
    np.testing.assert_allclose(found.std(axis=0), 1 / np.sqrt(3), rtol=0.1)


def test_draws_are_of_every_solution_that_fits():
    problem = line(12, noise=0.3, squared=True)
    found = draws(assess(problem, np.array([np.sqrt(2), -1.0]), noise_of(problem.samples, 0.3)))
    assert 0.3 < np.mean(found[:, 0] > 0) < 0.7


def test_the_field_s_spread_is_that_of_the_derivatives_where_it_is_small():
    problem = plume(noise=0.1)
    found = assess(problem, np.array([5.0, 5.0]), noise_of(problem.samples, 0.1))
    model, at = problem.model, (GRID.points, np.full(len(GRID.points), 10.0))
    theta = found.parameters.centre + found.parameters.half_width * draws(found, 400)
    best = found.solutions[0]
    std = field_std(model, model.field(best, 10.0, GRID), theta, 10.0, GRID, theta[:0]).ravel()
    slopes = model.jacobian(best[None], *at)[0] * found.parameters.half_width
    expected = np.sqrt(np.einsum("ck,kl,cl->c", slopes, found.axes.covariance, slopes))
    steep = expected > 0.2 * expected.max()
    np.testing.assert_allclose(std[steep], expected[steep], rtol=0.15)


@pytest.mark.parametrize(("keeps_solves", "fields"), [(True, 40), (False, 6)])
def test_the_spread_of_a_dear_model_follows_from_what_was_solved(keeps_solves, fields):
    problem = plume()
    found = assess(problem, np.array([5.0, 5.0]), noise_of(problem.samples, 1.0))
    theta = found.parameters.centre + found.parameters.half_width * draws(found)
    model, solved = (
        problem.model,
        found.solutions[0] + 3.0 * np.random.default_rng(0).normal(size=(40, 2)) * found.std,
    )
    dear, estimate = Opaque(model), model.field(found.solutions[0], 10.0, GRID)
    dear.field, asked = _counted(model.field)
    if keeps_solves:
        dear.solutions = object()
    told = field_std(dear, estimate, theta, 10.0, GRID, solved)
    expected = field_std(model, estimate, theta, 10.0, GRID, solved)
    np.testing.assert_allclose(
        told, expected, atol=0.02 * expected.max() if keeps_solves else 0.1 * expected.max()
    )
    assert len(asked) == fields
    assert {one.tobytes() for one in asked} <= {one.tobytes() for one in solved}


def _counted(field):
    """A model's field, and a list of the parameters that it is asked for."""
    asked = []

    def counting(theta, time, grid):
        asked.append(theta)
        return field(theta, time, grid)

    return counting, asked
