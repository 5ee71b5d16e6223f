"""Information gain: what a sample adds to the log determinant of the Fisher information (D-optimality)."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks, information
from fieldrl.core.kinds import component
from fieldrl.reward.outcome import Outcome, Outcomes, sensitivities


@component
class InformationGain:
    """What the newest sample adds to log det F, with F = I + sum over samples of J^T J / noise^2.

    J are the derivatives of the prediction by the parameters in half-widths of their bounds, at the
    estimate; I stands for what the bounds themselves tell. It rewards knowing the parameters, which
    Eq. (19) does not (a vehicle that sees nothing has small errors too).

    How to game it: have a wrong estimate that promises much. Sensitivities are those of the *predicted*
    field, so a policy is paid for being where the feature would be, were the estimate true. The next fit,
    which sees no feature there, ends that; what was paid stays paid.

    Args:
        noise: standard deviation of a sample's noise [field unit].
    """

    noise: float = 1.0

    needs_derivatives: ClassVar[bool] = True
    needs_errors: ClassVar[bool] = False

    def __post_init__(self) -> None:
        checks.positive("noise", self.noise, "field unit")

    def __call__(self, outcome: Outcome) -> float:
        """The reward of the newest sample; raises TypeError for a model without derivatives."""
        return float(_gains(sensitivities(outcome, self.noise)[None])[0])

    def many(self, outcomes: Outcomes) -> NDArray[np.float64]:
        """The same of many missions, (B,)."""
        return _gains(outcomes.slopes / self.noise)


def _gains(scaled: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the last of S (B, n, p) adds to log det F, (B,)."""
    newest = scaled[:, -1]
    known = information.fisher(scaled[:, :-1])
    gains = np.vecdot(newest, np.linalg.solve(known, newest[..., None])[..., 0])
    return np.array([math.log1p(gain) for gain in gains.tolist()])
