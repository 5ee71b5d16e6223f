"""Potential-based shaping (Ng, Harada & Russell 1999): a hint of the way that changes no best policy."""

from __future__ import annotations

import math
from typing import Any

from fieldrl.core import checks
from fieldrl.core.kinds import component
from fieldrl.pde.tracer import predicted_place
from fieldrl.reward.outcome import Outcome, Reward


@component
class Shaped:
    """Another reward, plus discount phi(s') - phi(s), with phi = -weight distance / scale.

    The distance is that to the predicted feature: where the flow of the estimate carries its centre. phi is
    0 at the start and at the end of an episode, so that what is added sums up to nothing for every policy
    (without discount), and the best policy stays the best. It only tells earlier whether it went well.

    Args:
        reward: what is shaped.
        weight: of the distance, in units of that reward.
        scale: the distance that counts one [length].
        discount: the agent's.
    """

    reward: Reward
    weight: float = 1.0
    scale: float = 100.0
    discount: float = 1.0

    def __post_init__(self) -> None:
        checks.positive("weight", self.weight)
        checks.positive("scale", self.scale, "length")
        object.__setattr__(self, "discount", checks.between("discount", self.discount, 0, 1))

    @property
    def needs_derivatives(self) -> bool:
        """Whether what is shaped does."""
        return getattr(self.reward, "needs_derivatives", False)

    @property
    def needs_errors(self) -> bool:
        """Whether what is shaped does."""
        return getattr(self.reward, "needs_errors", True)

    def __call__(self, outcome: Outcome) -> float:
        """The shaped reward of the newest sample."""
        n = len(outcome.problem.samples)
        after = 0.0 if n == outcome.steps else self._potential(outcome, n - 1, outcome.theta)
        before = 0.0 if n == 1 else self._potential(outcome, n - 2, outcome.previous_theta)
        return self.reward(outcome) + self.discount * after - before

    def _potential(self, outcome: Outcome, newest: int, theta: Any) -> float:
        """phi when sample ``newest`` was the last, with the estimate of then."""
        model: Any = outcome.problem.model
        samples = outcome.problem.samples
        feature = predicted_place(model, theta, samples.times[newest])
        return -self.weight * math.dist(samples.positions[newest], feature) / self.scale
