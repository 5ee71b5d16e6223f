"""Is the motion right? Closed circles, exact drift, exact arcs, and convergence of the substeps."""

import math

import numpy as np
import pytest

from fieldrl.core.domain import Domain
from fieldrl.core.streams import stream
from fieldrl.pde.flow import DoubleGyre, UniformFlow
from fieldrl.vehicle.unicycle import Unicycle

LEFT, DRIFT = 3, 6
WIDE = Domain((-1000, -1000), (1000, 1000))


def end_of_episode(vehicle, actions, flow, theta, domain):
    state = vehicle.initial()
    for i, action in enumerate(actions):
        state = vehicle.step(state, int(action), i * vehicle.time_step, flow, np.array(theta), domain)
    return state


@pytest.mark.parametrize("sides", [8, 16, 100])
def test_turning_all_the_way_round_in_still_water_closes_the_circle(sides):
    vehicle = Unicycle(heading_limits=None, turn=2 * math.pi / sides)
    end = end_of_episode(vehicle, [LEFT] * sides, UniformFlow(), (0, 0), WIDE)
    assert np.allclose(end, vehicle.initial(), atol=1e-9)


def test_the_vehicle_stays_on_the_circle_of_radius_speed_over_rate():
    vehicle = Unicycle(heading_limits=None)
    radius, state = 10 / (math.pi / 8), vehicle.initial()
    for _ in range(16):
        state = vehicle.step(state, LEFT, 0.0, UniformFlow(), np.zeros(2), WIDE)
        assert math.hypot(state[0] - 20, state[1] - 20 - radius) == pytest.approx(radius, abs=1e-7)


def test_a_passive_vehicle_drifts_exactly_with_a_uniform_flow():
    end = end_of_episode(Unicycle(), [DRIFT] * 20, UniformFlow(), (3.7, -1.3), WIDE)
    assert np.allclose(end, [20 + 20 * 3.7, 20 - 20 * 1.3, 0], atol=1e-11)


def test_the_flow_adds_to_the_vehicles_own_motion():
    actions = stream(0, "test").integers(7, size=20)
    still = end_of_episode(Unicycle(), actions, UniformFlow(), (0, 0), WIDE)
    drifting = end_of_episode(Unicycle(), actions, UniformFlow(), (2, 1), WIDE)
    assert np.allclose(drifting - still, [40, 20, 0], atol=1e-10)


def test_a_passive_vehicle_keeps_its_streamline_in_a_steady_gyre():
    flow, theta = DoubleGyre(), np.array([0.0, 1.0])
    vehicle = Unicycle(start=(60, 40))
    end = end_of_episode(vehicle, [DRIFT] * 10, flow, theta, Domain((0, 0), (200, 100)))
    psi = flow.streamfunction(theta, np.array([vehicle.start, end[:2]]), 0.0)
    assert psi[1] == pytest.approx(psi[0], rel=1e-7)


EPISODES = [
    (UniformFlow(), (5.0, 5.0), Domain(), (20.0, 20.0), 20),
    (DoubleGyre(), (0.25, math.pi / 5), Domain((0, 0), (200, 100)), (60.0, 40.0), 10),
]


@pytest.mark.parametrize(("flow", "theta", "domain", "start", "steps"), EPISODES)
def test_halving_the_substep_moves_the_end_of_an_episode_by_less_than_a_thousandth(
    flow, theta, domain, start, steps
):
    once, twice = Unicycle(start=start), Unicycle(start=start, substeps=2 * Unicycle().substeps)
    for episode in range(200):
        actions = stream(7, "actions", episode).integers(7, size=steps)
        ends = [end_of_episode(vehicle, actions, flow, theta, domain) for vehicle in (once, twice)]
        assert np.abs(ends[0] - ends[1]).max() < 1e-3


def test_the_error_falls_with_the_fourth_power_of_the_substep():
    flow, theta, domain = DoubleGyre(), (0.25, math.pi / 5), Domain((0, 0), (200, 100))
    actions = [3, 0, 2, 6, 1]

    def end(substeps):
        return end_of_episode(Unicycle(start=(60, 40), substeps=substeps), actions, flow, theta, domain)

    substeps = np.array([4, 8, 16, 32])
    errors = [np.abs(end(int(n)) - end(256)).max() for n in substeps]
    slope = np.polyfit(np.log(substeps), np.log(errors), 1)[0]
    assert slope == pytest.approx(-4, abs=0.4)
