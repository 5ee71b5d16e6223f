"""What planning agents share: what they are told, and the cross-entropy method over plans.

The cross-entropy method (Rubinstein 1999) draws plans from independent distributions of the action at
each step, and moves these towards the best of what was drawn.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.fixed import Fixed, State
from fieldrl.agent.situation import Situation
from fieldrl.core import information

Costs = Callable[[NDArray[np.int64]], NDArray[np.float64]]


class Planning(Fixed):
    """An agent that is asked to ``plan`` from a situation instead of to ``act`` on an observation."""

    def begin(self, low: NDArray[np.float64], high: NDArray[np.float64], actions: int) -> State:
        """The state: how many actions there are, (1,). The bounds are not looked at."""
        return {"actions": np.array([actions])}

    def act(
        self, state: State, observation: NDArray[np.float64], rng: np.random.Generator, greedy: bool = False
    ) -> int:
        """Refuses: an observation says too little."""
        raise TypeError(f"{type(self).__name__} plans from a situation: call plan()")

    def plan(self, state: State, situation: Situation, rng: np.random.Generator) -> int:
        """The next action."""
        raise NotImplementedError


def expected_error(
    situation: Situation, plans: NDArray[np.int64], thetas: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mean over thetas (M, p) of sqrt(tr F^-1 / p) after each plan (K, H), (K,) [half-width]."""
    return information.uncertainty(situation.information(plans, thetas)).mean(axis=0)


def cross_entropy(
    costs: Costs,
    chances: NDArray[np.float64],
    rng: np.random.Generator,
    population: int,
    iterations: int,
) -> NDArray[np.int64]:
    """The plan of least cost that was drawn, (H,).

    Args:
        costs: of plans (K, H), (K,).
        chances: of each action at each step to begin with, (H, actions).
        rng: draws population H uniform numbers in each iteration.
        population: plans of an iteration; an eighth of them are the elite.
        iterations: how often they are drawn.
    """
    horizon, actions = chances.shape
    kept = np.empty((0, horizon), np.int64)
    for _ in range(iterations):
        uniform = rng.random((population, horizon))
        drawn = (uniform[..., None] > np.cumsum(chances, axis=1)[None, :, :-1]).sum(axis=-1)
        plans = np.concatenate([kept, drawn])
        elite = plans[np.argsort(costs(plans), kind="stable")[: max(1, population // 8)]]
        shares = (elite[..., None] == np.arange(actions)).mean(axis=0)
        chances = 0.3 * chances + 0.7 * shares
        kept = elite[:1]
    return kept[0]


def uniform(horizon: int, actions: int) -> NDArray[np.float64]:
    """Every action equally likely at every step, (H, actions)."""
    return np.full((horizon, actions), 1.0 / actions)
