"""Least squares by differences from several starts."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.estimator.descent import multi_start
from fieldrl.estimator.descent.multi_start import MultiStart
from fieldrl.estimator.least_squares import LeastSquares
from tests.unit.estimator.stand_ins import TRUE, Waves, advection, problem


def test_it_agrees_with_the_compiled_fit_on_the_closed_form():
    of = advection(6)
    ours, compiled = MultiStart(starts=16, tolerance=1e-8).fit(of), LeastSquares().fit(of)
    np.testing.assert_allclose(ours.loss, compiled.loss, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(ours.theta[0], compiled.theta[0], atol=1e-2)


def test_every_solve_is_counted_once_and_serves_all_folds():
    model = Waves()
    fit = MultiStart().fit(problem(model=model))
    assert len(model.solved) == len(set(model.solved)) == fit.evaluations
    assert {theta.tobytes() for theta in fit.theta} <= set(model.solved)


def test_failures_end_no_fit():
    fit = MultiStart().fit(problem(model=Waves(fails=lambda theta: theta[0] < 0.05)))
    assert np.isnan(fit.course.loss).any()
    np.testing.assert_allclose(fit.theta[0], TRUE, atol=0.1)


def test_the_budget_of_a_descent_is_kept():
    assert MultiStart(starts=1, budget=7).fit(problem(leave_one_out=False)).evaluations <= 7


def test_the_function_is_the_component():
    one, other = multi_start.fit(problem(), starts=3), MultiStart(starts=3).fit(problem())
    assert one.theta.tobytes() == other.theta.tobytes()


@pytest.mark.parametrize(
    ("key", "value"), [("starts", 0), ("budget", 1), ("tolerance", 0), ("difference", 1)]
)
def test_bad_settings_are_refused_by_name(key, value):
    with pytest.raises(InvalidValue, match=f"^{key}="):
        MultiStart(**{key: value})
