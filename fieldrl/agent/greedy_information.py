"""Greedy one-step information gain: the action whose sample tells most, were the estimate true."""

from __future__ import annotations

import numpy as np

from fieldrl.agent.fixed import State
from fieldrl.agent.planning import Planning
from fieldrl.agent.situation import Situation
from fieldrl.core.kinds import component


@component
class GreedyInformation(Planning):
    """Takes the action of greatest log det F after one more sample.

    It looks one step ahead: where no step reaches the feature, what all of them promise is tiny, and the
    largest of it still points to where the feature is predicted.
    """

    def plan(self, state: State, situation: Situation, rng: np.random.Generator) -> int:
        """The best action; draws nothing."""
        plans = np.arange(state["actions"].item())[:, None]
        known = situation.information(plans, situation.theta[None])[0]
        return int(np.argmax(np.linalg.slogdet(known).logabsdet))
