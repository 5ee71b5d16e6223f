"""The agents that learn nothing."""

import math

import numpy as np
import pytest

from fieldrl.agent.drift import Drift
from fieldrl.agent.lawnmower import AHEAD, CLOCKWISE, COUNTER_CLOCKWISE, Lawnmower
from fieldrl.agent.random import Random
from fieldrl.core.checks import InvalidValue
from fieldrl.core.streams import stream
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.mission import Mission, run_replicate
from fieldrl.pde.advection import Advection
from fieldrl.reward.total_error import TotalError
from fieldrl.vehicle.unicycle import Unicycle

LIMITED = np.array([0.0, 0.0, -math.pi / 4, 0.0]), np.array([200.0, 200.0, math.pi / 4, 60.0])
FREE = np.array([0.0, 0.0, -math.pi, 0.0]), np.array([200.0, 200.0, math.pi, 60.0])
TURN, SPEED = math.pi / 8, 10.0


def survey(low, high, steps=60, start=(20.0, 20.0)):
    """The track of the lawnmower in still water, by a coarse model of the vehicle, (steps + 1, 3)."""
    agent = Lawnmower()
    state, pose, track = agent.begin(low, high, 7), np.array([*start, 0.0]), []
    for i in range(steps):
        track.append(pose.copy())
        action = agent.act(state, np.array([*pose, float(i)]), stream(0, "test"))
        pose[2] += {AHEAD: 0.0, CLOCKWISE: -TURN, COUNTER_CLOCKWISE: TURN}[action]
        pose[2] = np.clip(pose[2], low[2], high[2])
        pose[:2] += SPEED * np.array([math.cos(pose[2]), math.sin(pose[2])])
        pose[:2] = np.clip(pose[:2], low[:2], high[:2])
    return np.array([*track, pose])


def test_with_limited_heading_it_zigzags_at_the_limit():
    track = survey(*LIMITED)
    assert np.all(np.diff(track[:, 0]) >= 0)
    assert np.mean(np.isclose(np.abs(track[:, 2]), math.pi / 4)) > 0.7


def test_with_free_heading_its_lanes_run_straight_up_and_down():
    track = survey(*FREE)
    assert np.mean(np.isclose(np.abs(track[:, 2]), math.pi / 2)) > 0.5
    assert np.all(np.diff(track[:, 0]) >= -1e-9)


@pytest.mark.parametrize("bounds", [LIMITED, FREE])
def test_it_sweeps_the_domain_from_bottom_to_top_and_back(bounds):
    y = survey(*bounds)[:, 1]
    assert y.max() > 165
    assert y[np.argmax(y) :].min() < 35


@pytest.mark.parametrize(("y", "action"), [(20.0, COUNTER_CLOCKWISE), (180.0, CLOCKWISE), (120.0, CLOCKWISE)])
def test_an_episode_begins_towards_the_farther_wall(y, action):
    agent = Lawnmower()
    state = agent.begin(*LIMITED, 7)
    assert agent.act(state, np.array([50.0, y, 0.0, 0.0]), stream(0, "test")) == action


@pytest.mark.parametrize("agent", [Lawnmower(), Drift()])
def test_it_needs_the_seven_actions(agent):
    with pytest.raises(InvalidValue, match="seven actions"):
        agent.begin(*LIMITED, 3)


def test_the_drifter_is_carried_by_the_flow_alone():
    mission = Mission(Advection(), Unicycle(), Drift(), LeastSquares(), TotalError(), episodes=1, steps=5)
    positions = run_replicate(mission, seed=0, number=0)["position"].values[0]
    assert positions == pytest.approx(20.0 + 5.0 * np.arange(1, 6)[:, None] * np.ones(2))


@pytest.mark.parametrize(("key", "value"), [("margin", 0), ("margin", 0.5), ("tolerance", 0)])
def test_bad_values_are_refused_by_name(key, value):
    with pytest.raises(InvalidValue) as error:
        Lawnmower(**{key: value})
    assert error.value.key == key


def test_the_random_agent_takes_every_action_equally_often():
    agent, rng = Random(), stream(0, "test")
    state = agent.begin(*LIMITED, 7)
    counts = np.bincount([agent.act(state, np.zeros(4), rng) for _ in range(7000)], minlength=7)
    assert counts == pytest.approx(np.full(7, 1000), abs=120)
