"""A-optimality: by how much a sample shrinks the variances of the unknowns."""

from __future__ import annotations

import math
from typing import ClassVar

from fieldrl.core import checks
from fieldrl.core.information import uncertainty
from fieldrl.core.kinds import component
from fieldrl.reward.outcome import Outcome, before_and_after


@component
class AOptimal:
    """The fall of log sqrt(tr F^-1 / p) by the newest sample; F is that of the reward ``information_gain``.

    tr F^-1 is the sum of the variances of the unknowns in half-widths of their bounds, the expected square
    of the error that a contest measures. What it pays is decided by the unknown that is known worst, where
    the log determinant is content with one that is known very well.

    How to game it: as ``information_gain``, by a wrong estimate that promises much.

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
        before, after = before_and_after(outcome, self.noise)
        return math.log(uncertainty(before) / uncertainty(after))
