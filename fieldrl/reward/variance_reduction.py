"""Variance reduction: by how much a sample shrinks the variance of the predicted field (I-optimality)."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks, information
from fieldrl.core.kinds import component
from fieldrl.reward.outcome import Outcome, before_and_after

_CELLS = 16  # of the grid along each side of the domain


@component
class VarianceReduction:
    """The fall of the log root mean variance of the field at the end of the episode, by the newest sample.

    The variance of the field at a place is S F^-1 S^T there, to first order, with S the derivatives of the
    prediction by the parameters in half-widths of their bounds; its mean is taken over a grid of 16 x 16
    cells of the domain. It is F of the reward ``information_gain``.

    How to game it: believe that the feature has left the domain. Nothing is uncertain then, and nothing
    that is sampled changes it; a policy that cannot be paid any more is as well off anywhere.

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
        slopes = self._slopes(outcome)
        variance = [float(np.sum(slopes * np.linalg.solve(known, slopes.T).T)) for known in (before, after)]
        return 0.5 * math.log(variance[0] / variance[1]) if variance[1] > 0.0 else 0.0

    def _slopes(self, outcome: Outcome) -> NDArray[np.float64]:
        """S of the field at the end of the episode on the grid, (cells, p)."""
        model, times = outcome.problem.model, outcome.problem.samples.times
        points = model.domain.grid(_CELLS, _CELLS).points  # type: ignore[attr-defined]
        end = np.full(len(points), times[-1] * outcome.steps / len(times))  # samples are evenly spaced
        return information.sensitivities(model, outcome.theta, points, end, self.noise)
