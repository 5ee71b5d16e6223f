"""Is the learning right? A hand-worked episode, the forward view, a known optimum.

The forward views here are computed from their definitions (Eq. 21-23; Sutton & Barto 2018, section 12.4),
with n-step returns and no traces.
"""

import numpy as np
import pytest

from fieldrl.agent.sarsa_lambda import SarsaLambda
from fieldrl.agent.schedules import Linear
from fieldrl.agent.tile_coding import TileCoding
from fieldrl.core.streams import stream

LOW, HIGH = np.zeros(4), np.array([200.0, 200.0, 1.0, 20.0])


def one_tile_a_state(states):
    """A coding in which state i is the tile [i, i + 1) of x: a table."""
    return TileCoding(tilings=1, tiles=[states], variables=["x"])


def at(state):
    return np.array([state + 0.5, 0.0, 0.0, 0.0])


def worked_episode(traces):
    """Weights of (A, action 0) and (B, action 1) after A0 -(1)-> B1 -(2)-> A0 -(4)-> end."""
    agent = SarsaLambda(0.5, 0.5, 1.0, traces=traces, tile_coding=one_tile_a_state(2))
    state = agent.begin_episode(agent.begin(LOW, np.array([2.0, 1.0, 1.0, 1.0]), 2))
    a, b = at(0), at(1)
    agent.learn(state, a, 0, 1.0, b, 1, False)
    agent.learn(state, b, 1, 2.0, a, 0, False)
    agent.learn(state, a, 0, 4.0, b, 1, True)
    return [state["weights"][0, 0], state["weights"][1, 1]], state["weights"].sum()


# The first two steps are the same for all traces; alpha = lambda = 1/2, gamma = 1, all weights 0 at first:
#   step 1  delta = 1 + w_B1 - w_A0 = 1            z_A0 = 1              w_A0 = 0 + 1/2 1 1 = 0.5
#           traces decay                           z_A0 = 1/2
#   step 2  delta = 2 + w_A0 - w_B1 = 2.5          z_B1 = 1              w_B1 = 0 + 1/2 2.5 1 = 1.25
#                                                                        w_A0 = 0.5 + 1/2 2.5 1/2 = 1.125
#           traces decay                           z_A0 = 1/4, z_B1 = 1/2
#   step 3  delta = 4 - w_A0 = 2.875               z_B1 = 1/2, z_A0 rises, and the weights become
#     replacing      z_A0 = 1                      w_A0 = 1.125 + 1/2 2.875 1 = 2.5625
#                                                  w_B1 = 1.25 + 1/2 2.875 1/2 = 1.96875
#     accumulating   z_A0 = 1/4 + 1                w_A0 = 1.125 + 1/2 2.875 1.25 = 2.921875
#                                                  w_B1 = 1.96875
#     dutch          z_A0 = 1/4 + 1 - 1/2 1/4 = 1.125
#                    step 2 expected w_A0 = 0.5 here, it is 1.125: surprise 0.625
#                                                  w_A0 = 1.125 + 1/2 (2.875 + 0.625) 1.125 - 1/2 0.625
#                                                       = 2.78125
#                                                  w_B1 = 1.25 + 1/2 (2.875 + 0.625) 1/2 = 2.125
@pytest.mark.parametrize(
    ("traces", "expected"),
    [("replacing", [2.5625, 1.96875]), ("accumulating", [2.921875, 1.96875]), ("dutch", [2.78125, 2.125])],
)
def test_a_hand_worked_episode(traces, expected):
    weights, total = worked_episode(traces)
    assert weights == expected
    assert total == sum(expected)


def random_episode(rng, steps=12, actions=3):
    """Observations (steps + 1, 4) that revisit few places, actions (steps + 1,), rewards (steps,)."""
    places = rng.uniform(LOW, HIGH, (4, 4))
    return (
        places[rng.integers(4, size=steps + 1)],
        rng.integers(actions, size=steps + 1),
        rng.normal(size=steps),
    )


def value(agent, state, weights, observation, action):
    return weights[action, agent.tile_coding.active(observation, state["coder"])].sum()


def lambda_return(rewards, values, t, horizon, gamma, lam):
    """G_t^lambda cut at ``horizon``, Eq. 21-22; ``values[k]`` is the bootstrap at step k (0 at the end)."""
    returns, discounted = [], 0.0
    for n in range(1, horizon - t + 1):
        discounted += gamma ** (n - 1) * rewards[t + n - 1]
        returns.append(discounted + gamma**n * values[t + n])
    shares = [(1 - lam) * lam ** (n - 1) for n in range(1, horizon - t)] + [lam ** (horizon - t - 1)]
    return float(np.dot(shares, returns))


def learned(agent, state, seen, actions, rewards, frozen=None):
    """The weights after the episode, or the summed changes of weights that stay ``frozen``."""
    changes, last = np.zeros_like(state["weights"]), len(rewards) - 1
    for t, reward in enumerate(rewards):
        before = state["weights"].copy()
        agent.learn(state, seen[t], actions[t], reward, seen[t + 1], actions[t + 1], t == last)
        if frozen is not None:
            changes += state["weights"] - before
            state["weights"][:] = frozen
    return state["weights"] if frozen is None else changes


@pytest.mark.parametrize("lam", [0.0, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("gamma", [0.9, 1.0])
def test_accumulating_traces_with_frozen_weights_equal_the_forward_view(lam, gamma):
    agent = SarsaLambda(0.8, lam, gamma, traces="accumulating", tile_coding=TileCoding(8, 4))
    rng = stream(3, "episode")
    seen, actions, rewards = random_episode(rng)
    state = agent.begin_episode(agent.begin(LOW, HIGH, 3))
    frozen = rng.normal(size=state["weights"].shape)
    state["weights"][:] = frozen
    values = [value(agent, state, frozen, *pair) for pair in zip(seen, actions, strict=True)]
    values[-1] = 0.0
    expected, steps = np.zeros_like(frozen), len(rewards)
    for t in range(steps):
        error = lambda_return(rewards, values, t, steps, gamma, lam) - values[t]
        expected[actions[t], agent.tile_coding.active(seen[t], state["coder"])] += 0.8 / 8 * error
    assert np.allclose(learned(agent, state, seen, actions, rewards, frozen), expected, atol=1e-8)


@pytest.mark.parametrize("lam", [0.0, 0.5, 0.9, 1.0])
def test_dutch_traces_equal_the_online_forward_view(lam):
    agent, gamma = SarsaLambda(0.8, lam, 0.95, traces="dutch", tile_coding=TileCoding(8, 4)), 0.95
    rng = stream(4, "episode")
    seen, actions, rewards = random_episode(rng)
    state = agent.begin_episode(agent.begin(LOW, HIGH, 3))
    start = rng.normal(size=state["weights"].shape)
    state["weights"][:] = start
    steps, latest, values = len(rewards), start, [0.0]
    for horizon in range(1, steps + 1):
        bootstrap = value(agent, state, latest, seen[horizon], actions[horizon])
        values.append(0.0 if horizon == steps else bootstrap)
        latest = start.copy()
        for t in range(horizon):
            active = agent.tile_coding.active(seen[t], state["coder"])
            error = lambda_return(rewards, values, t, horizon, gamma, lam) - latest[actions[t], active].sum()
            latest[actions[t], active] += 0.8 / 8 * error
    assert np.allclose(learned(agent, state, seen, actions, rewards), latest, atol=1e-8)


@pytest.mark.parametrize("traces", ["replacing", "accumulating", "dutch"])
def test_the_optimum_of_a_small_chain_is_reached(traces):
    """States 0 to 4; action 0 goes left, 1 right; a step costs 1; beyond 4 it ends: q*(s, 1) = s - 5."""
    agent = SarsaLambda(
        step_size=0.3,
        exploration=0.3,
        traces=traces,
        tile_coding=one_tile_a_state(5),
        exploration_schedule=Linear(final=0.0, episodes=300),
    )
    state, rng = agent.begin(LOW, np.array([5.0, 1.0, 1.0, 1.0]), 2), stream(0, "chain")
    for _ in range(600):
        agent.begin_episode(state)
        place, terminated = int(rng.integers(5)), False
        action = agent.act(state, at(place), rng)
        while not terminated:
            following = max(place + (1 if action else -1), 0)
            terminated = following == 5
            next_action = agent.act(state, at(following), rng)
            agent.learn(state, at(place), action, -1.0, at(following), next_action, terminated)
            place, action = following, next_action
    assert [agent.act(state, at(place), rng, greedy=True) for place in range(5)] == [1] * 5
    assert np.allclose(state["weights"][1], [-5, -4, -3, -2, -1], atol=1e-3)
