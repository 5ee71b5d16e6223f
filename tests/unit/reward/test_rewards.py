"""Rewards, worked by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection
from fieldrl.reward.a_optimal import AOptimal
from fieldrl.reward.information_gain import InformationGain
from fieldrl.reward.outcome import Outcome
from fieldrl.reward.shaped import Shaped
from fieldrl.reward.total_error import TotalError
from fieldrl.reward.variance_reduction import VarianceReduction

MODEL, B = Advection(), np.array([5.0, 5.0])
RNG = np.random.default_rng(0)
WALK = Samples.of(RNG.uniform(20, 120, (20, 2)), np.arange(1.0, 21.0), RNG.uniform(0, 90, 20))


def outcome(n: int, e_total: float, previous: float = math.nan, steps: int = 20) -> Outcome:
    part = Samples.of(WALK.positions[:n], WALK.times[:n], WALK.values[:n])
    return Outcome(steps, e_total, previous, FitProblem(MODEL, part), B, B)


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


INFORMED = [InformationGain, AOptimal, VarianceReduction]


def scaled(noise: float) -> np.ndarray:
    """Sensitivities of all samples, (20, 2)."""
    return MODEL.jacobian(B[None], WALK.positions, WALK.times)[0] * 15.0 / noise


@pytest.mark.parametrize("noise", [1.0, 0.3])
def test_gains_of_a_optimality_sum_to_how_much_better_the_flow_is_known(noise):
    total = sum(AOptimal(noise)(outcome(n, 1.0)) for n in range(1, 21))
    variances = np.linalg.inv(np.eye(2) + scaled(noise).T @ scaled(noise))
    assert total == pytest.approx(-0.5 * np.log(np.trace(variances) / 2), rel=1e-9)


def test_the_gain_in_variance_is_that_of_the_field_at_the_end():
    points = MODEL.domain.grid(16, 16).points
    slopes = MODEL.jacobian(B[None], points, np.full(len(points), 20.0))[0] * 15.0

    def variance(n: int) -> float:
        known = np.eye(2) + scaled(1.0)[:n].T @ scaled(1.0)[:n]
        return float(np.mean(np.einsum("ki,ij,kj->k", slopes, np.linalg.inv(known), slopes)))

    assert VarianceReduction()(outcome(10, 1.0)) == pytest.approx(0.5 * math.log(variance(9) / variance(10)))


@pytest.mark.parametrize("reward", INFORMED)
def test_a_sample_that_sees_nothing_gains_nothing(reward):
    far = Samples.of([[60.0, 60.0], [1e5, 1e5]], [1.0, 2.0], [90.0, 0.0])
    assert reward()(Outcome(20, 1.0, 1.0, FitProblem(MODEL, far), B, B)) == 0.0


def test_no_field_is_left_to_learn_of_when_it_has_left_the_domain():
    gone = Outcome(20, 1.0, 1.0, FitProblem(MODEL, WALK), np.array([1e4, 1e4]), B)
    assert VarianceReduction()(gone) == 0.0


@pytest.mark.parametrize("plain", [TotalError(), InformationGain()])
def test_shaping_adds_nothing_to_the_return_of_any_walk(plain):
    outcomes = [outcome(n, 2.0, 3.0) for n in range(1, 21)]
    shaped = Shaped(plain, weight=7.0, scale=30.0)
    assert sum(map(shaped, outcomes)) == pytest.approx(sum(map(plain, outcomes)))


def test_shaping_pays_for_coming_closer_to_where_the_feature_is_predicted():
    walk = Samples.of([[200.0, 65.0], [150.0, 70.0]], [3.0, 4.0], [0.0, 0.0])
    reward = Shaped(TotalError(), weight=2.0, scale=10.0)
    found = reward(Outcome(20, 2.0, 2.0, FitProblem(MODEL, walk), B, np.zeros(2)))
    hint = -2.0 * 80.0 / 10.0 + 2.0 * math.dist((200.0, 65.0), (50.0, 50.0)) / 10.0
    assert found == pytest.approx(1 - 0.1**0.4 + hint)


@pytest.mark.parametrize("reward", INFORMED)
def test_information_needs_derivatives(reward):
    class Plain:
        parameters = MODEL.parameters
        predict = MODEL.predict
        field = MODEL.field

    problem = FitProblem(Plain(), Samples.of([[1.0, 1.0]], [1.0], [0.0]))
    with pytest.raises(TypeError, match="Plain has no derivatives"):
        reward()(Outcome(20, 1.0, 1.0, problem, B, B))


@pytest.mark.parametrize("reward", INFORMED)
def test_a_probe_without_noise_is_refused(reward):
    with pytest.raises(InvalidValue, match="noise=0"):
        reward(0.0)
