"""The oracle: the best path for the known truth, the bound for all agents. It is no agent for the sea."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.fixed import State
from fieldrl.agent.planning import Planning, cross_entropy, expected_error, uniform
from fieldrl.agent.situation import Situation
from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class Oracle(Planning):
    """Plans the whole mission at its start by direct optimisation of sqrt(tr F^-1 / p) at the truth.

    Args:
        population: plans of an iteration of the cross-entropy method, >= 8.
        iterations: of it, >= 1.
        restarts: the best of so many searches is followed, >= 1.
    """

    population: int = 256
    iterations: int = 20
    restarts: int = 3

    def __post_init__(self) -> None:
        checks.integer("population", self.population, 8)
        checks.integer("iterations", self.iterations, 1)
        checks.integer("restarts", self.restarts, 1)

    def plan(self, state: State, situation: Situation, rng: np.random.Generator) -> int:
        """The next action of the plan, which is made before the first sample."""
        done = len(situation.samples)
        if done == 0 or "plan" not in state:
            state["plan"], state["from"] = self._whole(state, situation, rng), np.array([done])
        return int(state["plan"][done - state["from"].item()])

    def _whole(self, state: State, situation: Situation, rng: np.random.Generator) -> NDArray[np.int64]:
        def costs(plans: NDArray[np.int64]) -> NDArray[np.float64]:
            return expected_error(situation, plans, situation.truth[None])

        chances = uniform(situation.left, state["actions"].item())
        found = [
            cross_entropy(costs, chances, rng, self.population, self.iterations) for _ in range(self.restarts)
        ]
        return found[int(np.argmin(costs(np.array(found))))]
