"""Eq. (19), the paper's reward: small errors."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component
from fieldrl.reward.outcome import Outcome, Outcomes

_STEEPEST, _FARTHEST = 4.0, 1e15  # of an exponent, and of what is raised to it: nothing overflows


@component
class TotalError:
    """Eq. (19): small errors early, and the inverse of the total error at the end.

    r = terminal / e_total at the last sample, c2 before sample ``early``, else c1 sign(c2) |c2|^power, with
    c1 = previous / e_total (1 at the first sample) and c2 = 1 - (e_total / scale)^exponent. The signed power
    gives a value where c2 < 0; errors are floored so that nothing divides by zero.

    How to game it: see nothing. Far from the feature every parameter explains the samples, so e_total is
    twice the noise's variance at once, and the policy that pays most stays away.

    Args:
        terminal: reward of a total error of 1 at the end [field unit^2].
        scale: the total error at which c2 changes sign [field unit^2].
        exponent: of the ratio in c2.
        power: of c2.
        early: samples before this one earn c2 alone.
        floor: least error that is told apart [field unit^2].
    """

    terminal: float = 100.0
    scale: float = 20.0
    exponent: float = 0.4
    power: float = 1.5
    early: int = 5
    floor: float = 1e-3

    def __post_init__(self) -> None:
        for name in ("terminal", "scale", "exponent", "power", "floor"):
            checks.positive(name, getattr(self, name))
        for name in ("exponent", "power"):
            checks.between(name, getattr(self, name), 0, _STEEPEST)
        checks.integer("early", self.early, 1)

    def __call__(self, outcome: Outcome) -> float:
        """The reward of the newest sample."""
        n = len(outcome.problem.samples)
        return _reward(n, outcome.steps, outcome.e_total, outcome.previous, self._settings)

    def many(self, outcomes: Outcomes) -> NDArray[np.float64]:
        """The same of many missions, (B,)."""
        return _rewards(outcomes.n, outcomes.steps, outcomes.e_total, outcomes.previous, self._settings)

    @cached_property
    def _settings(self) -> tuple[float, float, float, float, int, float]:
        settings = self.terminal, self.scale, self.exponent, self.power
        return *map(float, settings), self.early, float(self.floor)  # type: ignore[return-value]


@njit(cache=True)
def _reward(n, steps, e_total, previous, settings):
    terminal, scale, exponent, power, early, floor = settings
    error = max(e_total, floor)
    if n == steps:
        return terminal / error
    c2 = 1.0 - min(error / scale, _FARTHEST) ** exponent
    if n < early:
        return c2
    c1 = 1.0 if math.isnan(previous) else max(previous, floor) / error
    return c1 * math.copysign(abs(c2) ** power, c2)


@njit(cache=True)
def _rewards(n, steps, e_total, previous, settings):
    found = np.empty(e_total.size)
    for b in range(e_total.size):
        found[b] = _reward(n, steps, e_total[b], previous[b], settings)
    return found
