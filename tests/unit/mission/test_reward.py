"""Rewards, worked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission.reward import InformationGain, Outcome, TotalError
from fieldrl.pde.advection import Advection

MODEL, B = Advection(), np.array([5.0, 5.0])
RNG = np.random.default_rng(0)
WALK = Samples.of(RNG.uniform(20, 120, (20, 2)), np.arange(1.0, 21.0), RNG.uniform(0, 90, 20))


def outcome(n: int, e_total: float, previous: float = math.nan, steps: int = 20) -> Outcome:
    part = Samples.of(WALK.positions[:n], WALK.times[:n], WALK.values[:n])
    return Outcome(steps, e_total, previous, FitProblem(MODEL, part), B)


def test_early_samples_earn_c2_alone():
    assert TotalError()(outcome(4, 2.0, 8.0)) == pytest.approx(1 - 0.1**0.4)


def test_later_samples_earn_the_ratio_of_errors_times_c2_to_the_power():
    assert TotalError()(outcome(5, 2.0, 8.0)) == pytest.approx(4.0 * (1 - 0.1**0.4) ** 1.5)


def test_an_error_above_the_scale_is_punished_by_the_signed_power():
    c2 = 1 - 2.0**0.4
    assert c2 < 0
    assert TotalError()(outcome(10, 40.0, 20.0)) == pytest.approx(-0.5 * (-c2) ** 1.5)
    assert TotalError()(outcome(3, 40.0, 20.0)) == pytest.approx(c2)


def test_an_error_of_the_scale_earns_nothing():
    assert TotalError()(outcome(10, 20.0, 5.0)) == 0.0


def test_the_last_sample_earns_the_inverse_of_the_error():
    assert TotalError()(outcome(20, 4.0, 1.0)) == pytest.approx(25.0)


def test_an_episode_of_one_sample_ends_with_it():
    assert TotalError()(outcome(1, 4.0, steps=1)) == pytest.approx(25.0)


def test_the_first_sample_has_no_previous_error_so_its_ratio_is_one():
    assert TotalError(early=1)(outcome(1, 2.0)) == pytest.approx((1 - 0.1**0.4) ** 1.5)


def test_errors_are_floored_before_anything_divides_by_them():
    reward = TotalError()
    assert reward(outcome(20, 0.0)) == pytest.approx(1e5)
    assert reward(outcome(9, 0.0, 0.0)) == pytest.approx((1 - (1e-3 / 20) ** 0.4) ** 1.5)
    assert reward(outcome(9, 2.0, 0.0)) == pytest.approx(5e-4 * (1 - 0.1**0.4) ** 1.5)


def test_every_constant_of_the_formula_can_be_set():
    reward = TotalError(terminal=7.0, scale=10.0, exponent=0.5, power=2.0, early=3, floor=1.0)
    assert reward(outcome(20, 0.1)) == pytest.approx(7.0)
    assert reward(outcome(3, 2.5, 5.0)) == pytest.approx(2.0 * 0.5**2)
    assert reward(outcome(2, 2.5, 5.0)) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("key", "value"),
    [("terminal", 0.0), ("scale", -1.0), ("exponent", 0.0), ("power", -2.0), ("early", 0), ("floor", 0.0)],
)
def test_a_bad_constant_is_refused_by_its_name(key, value):
    with pytest.raises(InvalidValue) as error:
        TotalError(**{key: value})
    assert error.value.key == key


@pytest.mark.parametrize("noise", [1.0, 0.3])
def test_gains_of_information_sum_to_the_log_determinant(noise):
    reward = InformationGain(noise)
    total = sum(reward(outcome(n, 1.0)) for n in range(1, 21))
    slopes = MODEL.jacobian(B[None], WALK.positions, WALK.times)[0] * 15.0 / noise
    assert total == pytest.approx(np.linalg.slogdet(np.eye(2) + slopes.T @ slopes)[1], rel=1e-9)


def test_a_sample_that_sees_nothing_gains_nothing():
    far = Samples.of([[60.0, 60.0], [1e5, 1e5]], [1.0, 2.0], [90.0, 0.0])
    assert InformationGain()(Outcome(20, 1.0, 1.0, FitProblem(MODEL, far), B)) == 0.0


def test_information_needs_derivatives():
    class Plain:
        parameters = MODEL.parameters
        predict = MODEL.predict
        field = MODEL.field

    problem = FitProblem(Plain(), Samples.of([[1.0, 1.0]], [1.0], [0.0]))
    with pytest.raises(TypeError, match="Plain has no derivatives"):
        InformationGain()(Outcome(20, 1.0, 1.0, problem, B))


def test_a_probe_without_noise_is_refused():
    with pytest.raises(InvalidValue, match="noise=0"):
        InformationGain(0.0)
