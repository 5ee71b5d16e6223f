"""The random agent: every action is equally likely, whatever is observed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.fixed import Fixed, State
from fieldrl.core.kinds import component


@component
class Random(Fixed):
    """Uniformly random actions."""

    def begin(self, low: NDArray[np.float64], high: NDArray[np.float64], actions: int) -> State:
        """The state: how many actions there are, (1,). ``low`` and ``high``, (4,), are not looked at."""
        return {"actions": np.array([actions])}

    def act(
        self, state: State, observation: NDArray[np.float64], rng: np.random.Generator, greedy: bool = False
    ) -> int:
        """A random action, greedy or not; draws one number."""
        return int(rng.random() * state["actions"].item())
