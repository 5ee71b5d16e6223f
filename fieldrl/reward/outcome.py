"""What a reward is called with."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import information
from fieldrl.estimator.problem import FitProblem


class Outcome(NamedTuple):
    """What a reward may look at: no truth, only what the vehicle knows.

    Args:
        steps: N, samples of an episode.
        e_total: total error after the newest sample [field unit^2].
        previous: total error before it; NaN at the first [field unit^2].
        problem: the fit problem with all samples so far.
        theta: the estimate, (p,).
        previous_theta: the estimate before the newest sample, (p,); the centre of the bounds at the first.
    """

    steps: int
    e_total: float
    previous: float
    problem: FitProblem
    theta: NDArray[np.float64]
    previous_theta: NDArray[np.float64]


class Outcomes(NamedTuple):
    """``Outcome`` of B missions that have n samples each, as a reward with a method ``many`` wants it.

    Args:
        steps: N, samples of an episode.
        n: samples so far.
        e_total: total errors after the newest sample, (B,) [field unit^2].
        previous: total errors before it; NaN at the first, (B,) [field unit^2].
        slopes: derivatives of all predictions by the unknowns in half-widths, at the estimate, (B, n, p)
            [field unit].
    """

    steps: int
    n: int
    e_total: NDArray[np.float64]
    previous: NDArray[np.float64]
    slopes: NDArray[np.float64]


class Reward(Protocol):
    """What a sample is worth. With a method ``many`` of ``Outcomes`` it serves compiled batches as well.

    One that does not look at total errors says ``needs_errors = False``; they may be NaN then.
    """

    def __call__(self, outcome: Outcome) -> float: ...


def sensitivities(outcome: Outcome, noise: float) -> NDArray[np.float64]:
    """S of all samples at the estimate of now, (n, p); see ``fieldrl.core.information``.

    Raises:
        TypeError: the model has no derivatives.
    """
    model, samples = outcome.problem.model, outcome.problem.samples
    if not hasattr(model, "jacobian"):
        raise TypeError(f"{type(model).__name__} has no derivatives; use another reward")
    return information.sensitivities(model, outcome.theta, samples.positions, samples.times, noise)


def before_and_after(outcome: Outcome, noise: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """F without and with the newest sample, both at the estimate of now, (p, p) each."""
    scaled = sensitivities(outcome, noise)
    return information.fisher(scaled[:-1]), information.fisher(scaled)
