"""Composite Bayesian optimisation: what it finds, what it asks for, what it shares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from fieldrl.core.checks import InvalidValue, SolveFailed
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.descent.multi_start import MultiStart
from fieldrl.estimator.surrogate.acquisition import Solves, neighbours
from tests.unit.estimator.stand_ins import TRUE, Waves, passing, problem, samples


def least_losses(of):
    """The least loss of every fold on a fine grid of theta."""
    axis = np.linspace(-1, 1, 401)
    theta = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    a, b = theta.T[:, :, None]
    x, y = of.samples.positions.T
    predicted = 20 * np.sin(4 * (x * a + y * b)) + 10 * of.samples.times * np.exp(-((a + b * x) ** 2))
    return of.losses(predicted - of.samples.values, theta).min(axis=0)


@pytest.mark.parametrize("seed", range(5))
def test_every_fold_is_within_its_tolerance_of_the_global_minimum(seed):
    of = problem(seed=seed)
    fit, least = Composite().fit(of), least_losses(of)
    losses = of.losses(of.residuals(fit.theta), fit.theta).diagonal()
    assert losses[0] <= 1.001 * least[0]
    assert np.all(losses <= least + 0.01 * np.maximum(least, least[0]))
    np.testing.assert_allclose(fit.loss, losses, rtol=0.01)
    assert fit.converged.all()


@pytest.mark.parametrize("width", [0.1, 0.3])
def test_a_feature_that_few_places_show_is_found(width):
    """Seed 8 at 0.3 was missed by a surrogate that was trusted although its own errors were too large."""
    for seed in range(12):
        of, truth = passing(seed, width)
        assert Composite().fit(of).loss[0] <= 1.001 * truth


def test_a_plateau_is_left_after_few_solves_and_not_taken_for_a_minimum():
    of, truth = passing(8, 0.05)
    fit = Composite().fit(of)
    assert fit.evaluations < 20
    assert fit.loss[0] <= 1.001 * truth or not fit.converged.any()


def test_nothing_is_solved_twice():
    model = Waves()
    fit = Composite().fit(problem(model=model))
    assert len(model.solved) == len(set(model.solved)) == fit.evaluations


def test_a_fit_whose_budget_is_spent_returns_real_solves_where_it_has_not_converged():
    model = Waves()
    fit = Composite(budget=5).fit(problem(model=model))
    assert not fit.converged.all()
    loose = fit.theta[~fit.converged]
    assert {theta.tobytes() for theta in loose} <= set(model.solved)
    assert np.all(fit.gap[~fit.converged] > 0)


def test_known_solves_are_returned_in_order_and_save_new_ones():
    first = Composite().fit(problem())
    again = Composite().fit(problem(known=first.known))
    assert len(first.known) == first.evaluations
    assert again.evaluations == 0
    assert again.known.tobytes() == first.known.tobytes()
    assert again.theta.tobytes() == first.theta.tobytes()
    more = Composite().fit(problem(seed=1, known=first.known))
    assert more.known[: len(first.known)].tobytes() == first.known.tobytes()
    assert more.evaluations == len(more.known) - len(first.known)


def test_without_sharing_known_solves_change_nothing():
    alone = Composite(share=False).fit(problem())
    known = np.array([TRUE])
    fit = Composite(share=False).fit(problem(known=known))
    assert fit.known is known
    assert fit.theta.tobytes() == alone.theta.tobytes()


def test_a_failed_solve_is_left_out_said_and_not_tried_again():
    model = Waves(fails=lambda theta: theta[0] < 0.1)
    fit = Composite().fit(problem(model=model))
    lost = np.isnan(fit.course.loss)
    assert lost.any()
    assert not lost.all()
    assert len(fit.course.theta) == fit.evaluations
    assert len(fit.known) == np.sum(~lost)
    np.testing.assert_allclose(fit.theta[0], TRUE, atol=0.1)
    apart = np.abs(fit.course.theta[lost][:, None] - fit.course.theta[lost]).max(axis=2)
    assert np.min(apart + np.eye(len(apart))) > 0.05


def test_a_known_solve_that_fails_now_is_left_out():
    model = Waves(fails=lambda theta: theta[0] > 0.9)
    fit = Composite().fit(problem(model=model, known=np.array([[0.95, 0.0], [0.2, 0.1]])))
    assert fit.known[0].tolist() == [0.2, 0.1]


def test_where_every_solve_fails_the_failure_is_raised():
    with pytest.raises(SolveFailed, match="told to"):
        Composite(budget=5).fit(problem(model=Waves(fails=lambda theta: True)))


def test_the_budget_is_kept():
    assert Composite(budget=3).fit(problem()).evaluations == 3


def test_the_number_of_workers_and_blas_threads_changes_no_bit():
    fits = [Composite(batch=3, workers=workers).fit(problem()) for workers in (1, 2)]
    with threadpool_limits(limits=1):
        fits.append(Composite(batch=3).fit(problem()))
    assert len({fit.known.tobytes() for fit in fits}) == 1
    assert len({fit.theta.tobytes() for fit in fits}) == 1


def test_it_needs_fewer_solves_than_multi_start():
    few, many = Composite().fit(problem()), MultiStart().fit(problem())
    assert few.evaluations < many.evaluations
    assert few.loss[0] <= 1.01 * many.loss[0]


def test_many_known_solves_are_cut_to_neighbours_that_hold_the_best_of_every_fold():
    rng = np.random.default_rng(0)
    u, losses = rng.uniform(-1, 1, (300, 2)), rng.uniform(0, 1, (300, 5))
    near = neighbours(Solves(u, np.empty((300, 4)), losses), 40)
    assert len(near) == len(set(near)) == 40
    assert set(np.argmin(losses, axis=0)) <= set(near)


def test_no_more_solves_than_memory_allows_are_handed_on_the_best_among_them():
    known = np.random.default_rng(3).uniform(-1, 1, (80, 2))
    fit = Composite(memory=50).fit(problem(known=known))
    assert len(fit.known) == 50
    of = problem()
    every, kept = (of.losses(of.residuals(theta), theta) for theta in (known, fit.known))
    assert np.all(kept.min(axis=0) <= every.min(axis=0))


def test_many_known_solves_leave_the_minimum_where_it_is():
    known = np.random.default_rng(1).uniform(-1, 1, (200, 2))
    fit = Composite().fit(problem(known=known))
    assert fit.loss[0] <= 1.01 * least_losses(problem())[0]


def test_a_proposal_beside_a_solve_that_the_surrogate_left_out_takes_that_solve_in_instead():
    known = np.random.default_rng(2).uniform(-1, 1, (150, 2))
    fit = Composite(neighbours=10).fit(problem(known=known))
    new = fit.known[len(known) :]
    assert np.min(np.abs(new[:, None] - known).max(axis=2), initial=1.0) > 1e-6
    assert fit.loss[0] <= 1.01 * least_losses(problem())[0]


@pytest.mark.parametrize(
    ("key", "value"),
    [("initial", 1), ("budget", 0), ("tolerance", 0), ("floor", -1), ("batch", 0), ("tikhonov", -1)],
)
def test_bad_settings_are_refused_by_name(key, value):
    with pytest.raises(InvalidValue, match=f"^{key}="):
        Composite(**{key: value})


def test_one_unknown_and_three_unknowns_work_too():
    for p in (1, 3):
        of = replace(problem(), model=Linear(p), samples=samples(6))
        values = of.model.predict(np.full((1, p), 0.3), of.samples.positions, of.samples.times)[0]
        of = replace(of, samples=replace(of.samples, values=values))
        assert Composite().fit(of).loss[0] < 0.1


class Linear:
    """p powers of time."""

    def __init__(self, p):
        from fieldrl.core.parameters import Parameters

        self.p = p
        self.parameters = Parameters(tuple("abc"[:p]), ("1",) * p, (-1.0,) * p, (1.0,) * p)

    def predict(self, theta, positions, times):
        return 10 * theta @ (times[None] ** np.arange(self.p)[:, None])
