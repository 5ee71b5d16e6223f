"""What every agent owes the mission. A new YAML in conf/agent is tested by existing."""

import io
from pathlib import Path

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf

from fieldrl.core.streams import stream

PLANNING = {"gradient", "greedy_information", "oracle", "planner"}  # see test_planning_agents.py
CONFIGS = sorted((Path(__file__).parents[3] / "conf" / "agent").glob("*.yaml"))
CONFIGS = [path for path in CONFIGS if path.stem not in PLANNING]
LOW = np.array([0.0, 0.0, -np.pi / 4, 0.0, -200.0, -6.0, -200.0, -100.0, 0.0, -np.pi, 0.0])
HIGH = np.array([200.0, 100.0, np.pi / 4, 20.0, 200.0, 0.0, 200.0, 100.0, 224.0, np.pi, 1.0])
ACTIONS, STEPS = 7, 20


@pytest.fixture(params=CONFIGS, ids=lambda path: path.stem)
def agent(request):
    whole = OmegaConf.create({"episodes": 50, "agent": OmegaConf.load(request.param)})
    return instantiate(whole.agent)


def observations(rng):
    """The observations of an episode, (STEPS + 1, 11), some of them outside the bounds."""
    share = rng.uniform(-0.1, 1.1, size=(STEPS + 1, len(LOW)))
    share[:, 3] = np.linspace(0, 1, STEPS + 1)
    return LOW + share * (HIGH - LOW)


def episode(agent, state, rng):
    """One episode with random observations and rewards; the state after it, and the actions."""
    state = agent.begin_episode(state)
    seen, actions = observations(rng), []
    action = agent.act(state, seen[0], rng)
    for i in range(STEPS):
        actions.append(action)
        following = agent.act(state, seen[i + 1], rng)
        state = agent.learn(state, seen[i], action, rng.normal(), seen[i + 1], following, i == STEPS - 1)
        action = following
    return state, actions


def life(agent, episodes, seed=0):
    state, rng, actions = agent.begin(LOW, HIGH, ACTIONS), stream(seed, "test"), []
    for _ in range(episodes):
        state, chosen = episode(agent, state, rng)
        actions += chosen
    return state, actions


def same(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[key], other[key]) for key in one)


def test_there_are_agents_to_test():
    assert {"sarsa_lambda", "random", "lawnmower"} <= {path.stem for path in CONFIGS}


def test_every_action_is_an_index_as_python_counts(agent):
    _, actions = life(agent, 10)
    assert all(type(action) is int and 0 <= action < ACTIONS for action in actions)


def test_the_same_stream_gives_the_same_life(agent):
    (one, actions), (other, again) = life(agent, 5), life(agent, 5)
    assert actions == again
    assert same(one, other)


def test_two_lives_share_no_memory(agent):
    one, other = agent.begin(LOW, HIGH, ACTIONS), agent.begin(LOW, HIGH, ACTIONS)
    before = {key: array.copy() for key, array in other.items()}
    episode(agent, one, stream(0, "test"))
    assert same(other, before)
    assert not any(np.shares_memory(one[key], other[key]) for key in one)


def test_the_state_is_plain_arrays(agent):
    state, _ = life(agent, 2)
    assert all(isinstance(array, np.ndarray) and array.dtype.kind in "fib" for array in state.values())
    assert all(np.all(np.isfinite(array)) for array in state.values())


def test_a_saved_agent_goes_on_as_if_nothing_had_happened(agent):
    state, _ = life(agent, 3)
    file = io.BytesIO()
    np.savez(file, **state)
    file.seek(0)
    restored = dict(np.load(file))
    one, actions = episode(agent, state, stream(1, "test"))
    other, again = episode(agent, restored, stream(1, "test"))
    assert actions == again
    assert same(one, other)


def test_acting_greedily_does_not_change_what_is_learned(agent):
    state, _ = life(agent, 3)
    before = {key: array.copy() for key, array in state.items()}
    for observation in observations(stream(2, "test")):
        agent.act(state, observation, stream(3, "test"), greedy=True)
    learned = [key for key in state if key != "direction"]
    assert all(np.array_equal(state[key], before[key]) for key in learned)


def test_the_observation_is_left_alone(agent):
    state = agent.begin_episode(agent.begin(LOW, HIGH, ACTIONS))
    seen = observations(stream(4, "test"))
    before = seen.copy()
    action = agent.act(state, seen[0], stream(5, "test"))
    agent.learn(state, seen[0], action, 1.0, seen[1], 0, False)
    assert np.array_equal(seen, before)


def test_an_agent_is_a_value(agent):
    assert hash(agent) == hash(agent)
    assert agent == agent.__class__(**{name: getattr(agent, name) for name in agent.__dataclass_fields__})
