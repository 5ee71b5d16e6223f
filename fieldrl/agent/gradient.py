"""The gradient follower: to where the predicted field is highest."""

from __future__ import annotations

import numpy as np

from fieldrl.agent.fixed import State
from fieldrl.agent.planning import Planning
from fieldrl.agent.situation import Situation
from fieldrl.core.kinds import component


@component
class Gradient(Planning):
    """Takes the action that ends where the field of the estimate is highest: it climbs, and stays on top.

    On top of the feature the field has no slope, and a sample tells least of where the feature goes.
    """

    def plan(self, state: State, situation: Situation, rng: np.random.Generator) -> int:
        """The best action; draws nothing."""
        actions = state["actions"].item()
        positions, times = situation.paths(np.arange(actions)[:, None], situation.theta[None])
        at = situation.model.admissible(positions[0, :, 0])
        values = situation.model.predict(situation.theta[None], at, np.full(actions, times[0]))[0]
        return int(np.argmax(values))
