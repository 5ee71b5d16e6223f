"""A reward for being near the feature. It knows the truth: for controls whose answer is known."""

from __future__ import annotations

import math

import numpy as np

from fieldrl.core import checks
from fieldrl.core.kinds import component
from fieldrl.pde.tracer import predicted_place
from fieldrl.reward.outcome import Outcome

_LENGTH = 100.0  # the distance at which nothing is paid [length]
_TERMINAL = 100.0  # of Eq. (19): reward of a total error of 1


@component
class Distance:
    """An episode at the feature's centre returns ``size``, one at a distance of 100 nothing; linear between.

    So returns are positive, as those of Eq. (19) are, and values that begin at 0 are no hope.

    The noise is that of Eq. (19): 100 / (2 mean eps^2), with eps the noise of the episode's own samples. It
    is what Eq. (19) pays at the last sample to whoever knows the unknowns exactly, and depends on no action.

    Args:
        size: what 100 units of length nearer return, > 0.
        delayed: pay for the whole episode at its last sample, nothing before.
        noisy: add the noise of Eq. (19) at the last sample.
    """

    size: float = 20.0
    delayed: bool = False
    noisy: bool = False

    def __post_init__(self) -> None:
        checks.positive("size", self.size)

    def __call__(self, outcome: Outcome) -> float:
        """The reward of the newest sample."""
        n, last = len(outcome.problem.samples), len(outcome.problem.samples) == outcome.steps
        due = [n - 1] if not self.delayed else range(n) if last else ()
        near = sum(1.0 - _distance(outcome, i) / _LENGTH for i in due) / outcome.steps
        return self.size * near + (_noise(outcome) if self.noisy and last else 0.0)


def _distance(outcome: Outcome, i: int) -> float:
    """From sample i to the centre of the feature at its time [length]."""
    model, samples = outcome.problem.model, outcome.problem.samples
    true = np.array(model.parameters.true)
    return math.dist(samples.positions[i], predicted_place(model, true, samples.times[i]))


def _noise(outcome: Outcome) -> float:
    """What Eq. (19) pays at the end where the unknowns are known exactly."""
    model, samples = outcome.problem.model, outcome.problem.samples
    true = np.array(model.parameters.true)[None]
    noise = samples.values - model.predict(true, samples.positions, samples.times)[0]
    return _TERMINAL / (2.0 * float(np.mean(noise**2)))
