"""The paper's estimator: scikit-optimize on the scalar misfit."""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from fieldrl.core.checks import InvalidValue
from fieldrl.estimator.gaussian_process import GaussianProcess
from tests.unit.estimator.stand_ins import Waves, advection, problem

SMALL = GaussianProcess(budget=6, initial=4)


def test_the_literal_method_optimises_every_fold_apart():
    fit = SMALL.fit(problem(3))
    assert fit.evaluations == len(fit.course.theta) == 4 * 6
    assert fit.known.size == 0


def test_a_fold_apart_knows_only_its_own_solves():
    fit = SMALL.fit(problem(2))
    own = fit.course.theta.reshape(3, 6, 2)
    for theta, solves in zip(fit.theta, own, strict=True):
        assert theta.tobytes() in {solve.tobytes() for solve in solves}


def test_shared_solves_serve_folds_and_later_fits():
    shared = GaussianProcess(budget=8, initial=5, share=True)
    first = shared.fit(problem(3))
    assert len(first.known) == first.evaluations <= 4 * 8
    again = shared.fit(problem(3, known=first.known))
    assert again.known[: len(first.known)].tobytes() == first.known.tobytes()
    assert np.all(again.loss <= first.loss)


@pytest.mark.parametrize("scale", ["log", "linear"])
def test_failed_solves_are_told_as_something_finite(scale):
    model = Waves(fails=lambda theta: theta[0] > 0.2)
    fit = GaussianProcess(scale=scale, budget=8, initial=4).fit(problem(model=model, leave_one_out=False))
    assert np.isnan(fit.course.loss).any()
    assert np.isfinite(fit.loss[0])
    assert fit.evaluations == 8


def test_it_comes_near_the_minimum_of_a_simple_problem():
    fit = GaussianProcess(budget=20, initial=8).fit(advection(4, leave_one_out=False))
    np.testing.assert_allclose(fit.theta[0], 5.0, atol=1.5)


def test_threads_change_no_bit():
    one = SMALL.fit(problem(2))
    with threadpool_limits(limits=1):
        assert SMALL.fit(problem(2)).theta.tobytes() == one.theta.tobytes()


@pytest.mark.parametrize("noise", [None, 0.0, 0.1])
def test_noise_may_be_given_or_estimated(noise):
    assert (
        GaussianProcess(budget=5, initial=4, noise=noise).fit(problem(leave_one_out=False)).evaluations == 5
    )


@pytest.mark.parametrize(
    ("key", "value"), [("scale", "cubic"), ("design", "mine"), ("budget", 0), ("noise", -1), ("told", 0)]
)
def test_bad_settings_are_refused_by_name(key, value):
    with pytest.raises(InvalidValue, match=f"^{key}="):
        GaussianProcess(**{key: value})
