"""What agents that learn nothing have in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

State = dict[str, NDArray]


class Fixed:
    """A policy that no experience changes."""

    def begin_episode(self, state: State) -> State:
        """The same state."""
        return state

    def learn(
        self,
        state: State,
        observation: NDArray[np.float64],
        action: int,
        reward: float,
        next_observation: NDArray[np.float64],
        next_action: int,
        terminated: bool,
    ) -> State:
        """The same state."""
        return state
