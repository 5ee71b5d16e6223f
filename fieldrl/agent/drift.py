"""The drifter: it never uses its engine, the water carries it. What a float costs nothing to do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.fixed import Fixed, State
from fieldrl.core import checks
from fieldrl.core.kinds import component

STILL = 6  # of the actions of Eq. (12): no speed, no turn


@component
class Drift(Fixed):
    """Goes where the flow goes."""

    def begin(self, low: NDArray[np.float64], high: NDArray[np.float64], actions: int) -> State:
        """No state. ``low`` and ``high``, (4,), are not looked at.

        Raises:
            InvalidValue: there are not the seven actions of Eq. (12).
        """
        if actions != 7:
            raise checks.InvalidValue("actions", actions, "drifting needs the seven actions of Eq. (12)")
        return {}

    def act(
        self, state: State, observation: NDArray[np.float64], rng: np.random.Generator, greedy: bool = False
    ) -> int:
        """The action without speed; draws nothing."""
        return STILL
