"""The lawnmower: a systematic survey, up and down while advancing in x.

A lawnmower's lanes run along y, side by side in x. This one drives its lanes at full speed and as
steeply as the heading limits allow, but never beyond +-90 degrees, and turns round towards +x when it
comes near the lower or the upper wall. So its track is

- with headings limited to (-pi/4, pi/4): a zigzag at 45 degrees to the walls (to go straight up, let
  alone back, is not possible there);
- with free heading: lanes straight up and down, joined by U-turns as wide as the turning circle.

It never returns: where it reaches the wall of greatest x it keeps going up and down along it. Drift is
not compensated. It relies on the order of the actions of Eq. (12): 0 is full speed ahead, 2 full speed
turning clockwise, 3 full speed turning counter-clockwise.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.fixed import Fixed, State
from fieldrl.core import checks
from fieldrl.core.kinds import component

AHEAD, CLOCKWISE, COUNTER_CLOCKWISE = 0, 2, 3
_Y, _HEADING, _TIME = 1, 2, 3


@component
class Lawnmower(Fixed):
    """Lanes up and down, from the wall of least x to that of greatest x.

    Args:
        margin: how near to a wall it turns, as a fraction of the domain's height, in (0, 0.5); the larger,
            the more and the shorter the lanes.
        tolerance: a heading this close to the lane's is kept, > 0 [rad].
    """

    margin: float = 0.15
    tolerance: float = 0.1

    def __post_init__(self) -> None:
        if not 0 < checks.number("margin", self.margin) < 0.5:
            raise checks.InvalidValue("margin", self.margin, "must lie between 0 and 0.5")
        checks.positive("tolerance", self.tolerance, "rad")

    def begin(self, low: NDArray[np.float64], high: NDArray[np.float64], actions: int) -> State:
        """The state: bounds of the observation, (4,), and the lane's direction, (1,): 1 up, -1 down.

        Raises:
            InvalidValue: there are not the seven actions of Eq. (12).
        """
        if actions != 7:
            raise checks.InvalidValue("actions", actions, "the lawnmower needs the seven actions of Eq. (12)")
        return {
            "low": np.array(low, dtype=float),
            "high": np.array(high, dtype=float),
            "direction": np.ones(1),
        }

    def act(
        self, state: State, observation: NDArray[np.float64], rng: np.random.Generator, greedy: bool = False
    ) -> int:
        """Keeps the lane's heading, or turns towards it; draws nothing. Updates the direction in place."""
        state["direction"][0] = direction = self._direction(state, observation)
        steepest = (
            min(state["high"][_HEADING], math.pi / 2)
            if direction > 0
            else max(state["low"][_HEADING], -math.pi / 2)
        )
        deviation = float(steepest - observation[_HEADING])
        if abs(deviation) <= self.tolerance:
            return AHEAD
        return COUNTER_CLOCKWISE if deviation > 0 else CLOCKWISE

    def _direction(self, state: State, observation: NDArray[np.float64]) -> float:
        """1 on the way up, -1 on the way down; towards the farther wall when an episode begins."""
        low, high = state["low"], state["high"]
        share = (observation[_Y] - low[_Y]) / (high[_Y] - low[_Y])
        if share <= self.margin or share >= 1 - self.margin or observation[_TIME] <= low[_TIME]:
            return 1.0 if share < 0.5 else -1.0
        return float(state["direction"][0])
