"""A control that is no water: ten states in a row, paid at the end for how far up the row, with noise.

The agent is the experiment's own, with its shipped settings; there are 20 steps, as in an episode there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.streams import stream
from pipelines.diagnosis.learners import SEED

STATES, STEPS = 10, 20
_LOW, _HIGH = np.zeros(4), np.array([STATES - 1.0, 1.0, 1.0, STEPS])


def ends(agent: Any, size: float, noise: float, number: int, episodes: int) -> NDArray[np.float64]:
    """How far up the row each episode of a learning run ends, 0 to 1, (episodes,).

    Args:
        agent: with two actions, down and up.
        size: reward of the last state at the end; the first pays nothing.
        noise: standard deviation of what is added to it.
        number: of the replicate.
        episodes: how many.
    """
    exploration, chance = (stream(SEED, f"chain {name}", number) for name in ("exploration", "noise"))
    state, found = agent.begin(_LOW, _HIGH, 2), np.empty(episodes)
    for episode in range(episodes):
        state, found[episode] = _episode(agent, state, size, noise * chance.normal(), exploration)
    return found


def _episode(
    agent: Any, state: Any, size: float, error: float, rng: np.random.Generator
) -> tuple[Any, float]:
    state = agent.begin_episode(state)
    seen = _seen(STATES // 2, 0)
    action = agent.act(state, seen, rng)
    for step in range(1, STEPS + 1):
        place = min(max(int(seen[0]) + (1 if action else -1), 0), STATES - 1)
        following, last = _seen(place, step), step == STEPS
        reward = size * place / (STATES - 1) + error if last else 0.0
        then = 0 if last else agent.act(state, following, rng)
        state = agent.learn(state, seen, action, reward, following, then, last)
        seen, action = following, then
    return state, seen[0] / (STATES - 1)


def _seen(place: int, step: int) -> NDArray[np.float64]:
    return np.array([place, 0.5, 0.0, step])
