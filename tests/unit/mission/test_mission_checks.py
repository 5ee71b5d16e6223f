"""What a mission refuses before anything runs."""

from __future__ import annotations

import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.core.domain import Circle, Domain, Rectangle
from fieldrl.pde.advection import Advection
from fieldrl.reward.information_gain import InformationGain
from fieldrl.vehicle.unicycle import Unicycle

OBSTACLES = [Circle((20.0, 25.0), 10.0), Rectangle((10.0, 10.0), (30.0, 30.0))]


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=["circle", "rectangle"])
def test_a_start_inside_an_obstacle_is_refused_as_the_vehicle_s(mission, obstacle):
    with pytest.raises(InvalidValue) as error:
        mission(water=Advection(domain=Domain(obstacles=[obstacle])))
    assert error.value.key == "vehicle.start"


def test_a_start_outside_the_domain_is_refused(mission):
    with pytest.raises(InvalidValue) as error:
        mission(vehicle=Unicycle(start=(-1.0, 20.0)))
    assert error.value.key == "vehicle.start"


def test_a_start_on_the_wall_is_water(mission):
    assert mission(vehicle=Unicycle(start=(0.0, 20.0))).steps == 4


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("steps", 0),
        ("steps", 2.5),
        ("episodes", 0),
        ("episodes", True),
        ("evaluation_episodes", -1),
    ],
)
def test_an_impossible_budget_is_refused_by_its_name(mission, key, value):
    with pytest.raises(InvalidValue) as error:
        mission(**{key: value})
    assert error.value.key == key


def test_when_folds_are_fitted_is_one_of_two_words(mission):
    with pytest.raises(InvalidValue, match="every_step, as_needed") as error:
        mission(cross_validation="never")
    assert error.value.key == "cross_validation"


class Opaque:
    """A model without derivatives."""

    def __init__(self, horizon: float = 1e9) -> None:
        inner = Advection()
        self.parameters, self.predict, self.field = inner.parameters, inner.predict, inner.field
        self.domain, self.flow, self.truth, self.horizon = inner.domain, inner.flow, inner.truth, horizon
        self.admissible = inner.admissible


def test_information_gain_refuses_a_model_without_derivatives(mission):
    with pytest.raises(InvalidValue) as error:
        mission(water=Opaque(), reward=InformationGain())
    assert error.value.key == "reward"
    assert "total_error" in error.value.remedy


def test_an_episode_beyond_the_model_s_horizon_is_refused(mission):
    with pytest.raises(InvalidValue) as error:
        mission(water=Opaque(horizon=3.0))
    assert error.value.key == "steps"


def test_an_episode_that_ends_at_the_horizon_is_allowed(mission):
    assert mission(water=Opaque(horizon=4.0)).duration == 4.0


@pytest.mark.parametrize("true", [None, [5.0, None], [float("nan"), 5.0]], ids=["all", "one", "nan"])
def test_a_mission_needs_the_true_values_that_it_simulates(mission, true):
    with pytest.raises(InvalidValue, match="true value of b_x" if true != [5.0, None] else "b_y") as error:
        mission(water=Advection(true=true))
    assert error.value.key == "water.true"
