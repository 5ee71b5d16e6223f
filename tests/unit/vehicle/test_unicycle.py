"""The vehicle: actions, heading limits, walls, obstacles, and what its constructor refuses."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hydra.utils import instantiate
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import cfunc
from omegaconf import OmegaConf

from fieldrl.core.checks import InvalidValue
from fieldrl.core.compiled import FLOW
from fieldrl.core.domain import Circle, Domain, Rectangle
from fieldrl.vehicle.sensor import Sensor
from fieldrl.vehicle.unicycle import Unicycle

CONFIG = Path(__file__).parents[3] / "conf" / "vehicle" / "unicycle.yaml"
AHEAD, HALF, RIGHT, LEFT, HALF_RIGHT, HALF_LEFT, DRIFT = range(7)
STILL = np.zeros(2)
OPEN = Domain()


@cfunc(FLOW)
def _uniform(theta, constants, x, y, t, velocity):
    velocity[0] = theta[0]
    velocity[1] = theta[1]


@dataclass(frozen=True)
class Current:
    """A uniform flow of the test's own, so that the vehicle is tested without the water."""

    kernel: int = _uniform.address
    constants = np.empty(0)


CURRENT = Current()


def move(vehicle, state, action, theta=STILL, domain=OPEN):
    return vehicle.step(
        np.array(state, dtype=float), action, 0.0, CURRENT, np.array(theta, dtype=float), domain
    )


def test_actions_are_the_seven_of_eq_12_in_its_order():
    full, half, phi = 10.0, 5.0, math.pi / 8
    expected = [(full, 0), (half, 0), (full, -phi), (full, phi), (half, -phi), (half, phi), (0, 0)]
    assert np.array_equal(Unicycle().actions, expected)
    assert len(Unicycle().action_names) == 7


def test_the_config_builds_the_defaults():
    assert instantiate(OmegaConf.load(CONFIG)) == Unicycle()


def test_a_step_leaves_its_argument_alone():
    state = Unicycle().initial()
    move(Unicycle(), state, LEFT)
    assert np.array_equal(state, [20, 20, 0])


def test_full_speed_ahead_moves_along_the_heading():
    after = move(Unicycle(), [20, 20, math.pi / 6], AHEAD)
    assert np.allclose(after, [20 + 10 * math.cos(math.pi / 6), 25, math.pi / 6], atol=1e-12)


@pytest.mark.parametrize(("action", "sign"), [(LEFT, 1), (HALF_LEFT, 1), (RIGHT, -1), (HALF_RIGHT, -1)])
def test_plus_phi_is_counter_clockwise_at_every_speed(action, sign):
    vehicle = Unicycle()
    speed, turn = vehicle.actions[action]
    after = move(vehicle, [100, 100, 0], action)
    radius = speed * vehicle.time_step / turn
    expected = [100 + radius * math.sin(turn), 100 + radius * (1 - math.cos(turn)), turn]
    assert np.allclose(after, expected, atol=1e-7)
    assert np.sign(after[2]) == sign


def test_the_turn_stops_where_the_heading_limit_is_reached():
    vehicle = Unicycle(turn=math.pi / 8, heading_limits=(-0.1, 0.1))
    after = move(vehicle, [100, 100, 0], LEFT)
    rate, radius = math.pi / 8, 10 / (math.pi / 8)
    straight = 10 * (1 - 0.1 / rate)
    x = 100 + radius * math.sin(0.1) + straight * math.cos(0.1)
    y = 100 + radius * (1 - math.cos(0.1)) + straight * math.sin(0.1)
    assert np.allclose(after[:2], [x, y], atol=1e-9)
    assert after[2] == 0.1


def test_the_turn_is_spread_over_the_time_step_whatever_its_length():
    after = move(Unicycle(time_step=0.25), [100, 100, 0], LEFT)
    assert after[2] == pytest.approx(math.pi / 8)


@settings(deadline=None)
@given(st.floats(0.01, 3), st.floats(0, 3), st.floats(-1, 1), st.lists(st.integers(0, 6), max_size=12))
def test_the_heading_never_leaves_its_limits(turn, high, share, actions):
    vehicle = Unicycle(turn=turn, heading_limits=(-0.7, high), heading=share * (0.7 if share < 0 else high))
    state = vehicle.initial()
    for action in actions:
        state = move(vehicle, state, action)
        assert -0.7 <= state[2] <= high


def test_without_limits_the_heading_wraps_to_plus_minus_pi():
    vehicle = Unicycle(heading_limits=None, heading=3.0)
    after = move(vehicle, vehicle.initial(), LEFT)
    assert after[2] == pytest.approx(3.0 + math.pi / 8 - 2 * math.pi)
    assert vehicle.heading_bounds == (-math.pi, math.pi)


def test_drifting_moves_with_the_flow_alone():
    after = move(Unicycle(), [20, 20, 0.5], DRIFT, theta=(3, -2))
    assert np.allclose(after, [23, 18, 0.5], atol=1e-12)


def test_the_vehicle_slides_along_the_wall():
    after = move(Unicycle(), [195, 100, math.pi / 4], AHEAD)
    assert after[0] == 200
    assert after[1] == pytest.approx(100 + 10 / math.sqrt(2))


def test_a_move_into_a_rectangle_stops_at_its_edge():
    domain = Domain(obstacles=(Rectangle((25, 0), (30, 200)),))
    after = move(Unicycle(), [20, 20, 0], AHEAD, domain=domain)
    assert after[0] == pytest.approx(25, abs=1e-12)
    assert after[1] == pytest.approx(20, abs=1e-12)


def test_a_move_into_a_circle_stops_at_its_edge():
    domain = Domain(obstacles=(Circle((30, 20), 5),))
    after = move(Unicycle(), [20, 20, 0], AHEAD, domain=domain)
    assert np.allclose(after, [25, 20, 0], atol=1e-12)


def test_a_thin_obstacle_is_not_tunnelled_through():
    domain = Domain(obstacles=(Rectangle((25, 0), (25 + 1e-9, 200)),))
    after = move(Unicycle(max_speed=100), [20, 20, 0], AHEAD, domain=domain)
    assert after[0] == pytest.approx(25, abs=1e-12)


def test_a_vehicle_at_an_edge_leaves_it_as_soon_as_it_moves_away():
    domain = Domain(obstacles=(Rectangle((25, 0), (30, 200)),))
    at_edge = move(Unicycle(), [20, 20, 0], AHEAD, domain=domain)
    pressed = move(Unicycle(), at_edge, HALF, domain=domain)
    assert np.allclose(pressed, at_edge, atol=1e-9)
    assert move(Unicycle(), pressed, DRIFT, theta=(-2, 0), domain=domain)[0] == pytest.approx(23)


def test_a_vehicle_moves_along_an_edge_that_it_touches():
    domain = Domain(obstacles=(Rectangle((25, 0), (30, 150)),))
    after = move(Unicycle(), [25, 20, 0], DRIFT, theta=(0, 7), domain=domain)
    assert np.allclose(after, [25, 27, 0], atol=1e-12)


coordinate = st.floats(0, 100)
size = st.floats(0.01, 30)
rectangle = st.builds(
    lambda x, y, w, h: Rectangle((x, y), (x + w, y + h)), coordinate, coordinate, size, size
)
circle = st.builds(lambda x, y, radius: Circle((x, y), radius), coordinate, coordinate, size)
cluttered = st.builds(
    lambda shapes: Domain((0, 0), (100, 100), shapes), st.lists(st.one_of(rectangle, circle), max_size=5)
)


@settings(max_examples=300, deadline=None)
@given(cluttered, st.data())
def test_no_step_ends_inside_an_obstacle_or_outside_the_domain(domain, data):
    state = np.array([data.draw(coordinate), data.draw(coordinate), data.draw(st.floats(-3, 3))])
    if not domain.contains(state[:2]):
        return
    vehicle = Unicycle(heading_limits=None, substeps=data.draw(st.integers(1, 8)))
    theta = np.array([data.draw(st.floats(-40, 40)), data.draw(st.floats(-40, 40))])
    for action in data.draw(st.lists(st.integers(0, 6), min_size=1, max_size=10)):
        state = move(vehicle, state, action, theta, domain)
        assert domain.contains(state[:2])
        assert abs(state[2]) <= math.pi


@settings(max_examples=100, deadline=None)
@given(coordinate, st.floats(-1.5, 1.5), st.floats(1e-9, 1), st.floats(0, 60))
def test_a_wall_across_the_domain_is_never_passed(y, heading, thickness, drift):
    domain = Domain((0, 0), (100, 100), (Rectangle((50, -1), (50 + thickness, 101)),))
    vehicle, state = Unicycle(heading_limits=(-1.5, 1.5)), np.array([40, y, heading])
    for _ in range(5):
        state = move(vehicle, state, AHEAD, (drift, 0), domain)
        assert state[0] <= 50


def test_a_vehicle_wedged_between_obstacles_stays_in_the_water():
    domain = Domain(
        (0, 0), (100, 100), (Circle((50, 40), 10), Circle((50, 60), 10), Rectangle((50, 30), (60, 70)))
    )
    state = np.array([40.0, 50.0, 0.0])
    for _ in range(20):
        state = move(Unicycle(), state, AHEAD, domain=domain)
        assert domain.contains(state[:2])


def test_a_start_on_land_is_refused_with_a_way_out():
    domain = Domain(obstacles=(Circle((20, 20), 5),))
    with pytest.raises(InvalidValue, match=r"start=\(20\.0, 20\.0\): must lie in the domain.*move the start"):
        Unicycle().check_start(domain)
    with pytest.raises(InvalidValue, match="start"):
        Unicycle(start=(300, 20)).check_start(OPEN)
    Unicycle().check_start(OPEN)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("start", [1]),
        ("start", "here"),
        ("start", [1, math.nan]),
        ("heading", 1.0),
        ("heading", "north"),
        ("max_speed", -1),
        ("max_speed", 0),
        ("turn", 0),
        ("turn", -0.1),
        ("turn", 4),
        ("heading_limits", [1, -1]),
        ("heading_limits", [1]),
        ("time_step", 0),
        ("substeps", 0),
        ("substeps", 1.5),
        ("sensor", None),
    ],
)
def test_bad_values_are_refused_by_name(key, value):
    with pytest.raises(InvalidValue) as error:
        Unicycle(**{key: value})
    assert error.value.key == key


def test_a_vehicle_is_hashable_and_equal_to_its_twin():
    assert hash(Unicycle(sensor=Sensor(0.5))) == hash(Unicycle(sensor=Sensor(0.5)))
