"""Rewards: what a sample is worth.

| symbol | meaning | shape | unit |
|---|---|---|---|
| n, N | samples so far, samples of an episode | | |
| e_total | total error after this sample, Eq. (7) | | field unit^2 |
| F | Fisher information of the scaled parameters | (p, p) | |
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.estimator.problem import Differentiable, FitProblem


class Outcome(NamedTuple):
    """What a reward may look at: no truth, only what the vehicle knows.

    Args:
        steps: N, samples of an episode.
        e_total: total error after the newest sample [field unit^2].
        previous: total error before it; NaN at the first [field unit^2].
        problem: the fit problem with all samples so far.
        theta: the estimate, (p,).
    """

    steps: int
    e_total: float
    previous: float
    problem: FitProblem
    theta: NDArray[np.float64]


@dataclass(frozen=True)
class TotalError:
    """Eq. (19): small errors early, and the inverse of the total error at the end.

    r = terminal / e_total at the last sample, c2 before sample ``early``, else c1 sign(c2) |c2|^power, with
    c1 = previous / e_total (1 at the first sample) and c2 = 1 - (e_total / scale)^exponent. The signed power
    gives a value where c2 < 0; errors are floored so that nothing divides by zero.

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
        checks.integer("early", self.early, 1)

    def __call__(self, outcome: Outcome) -> float:
        """The reward of the newest sample."""
        n, error = len(outcome.problem.samples), max(outcome.e_total, self.floor)
        if n == outcome.steps:
            return self.terminal / error
        c2 = 1.0 - (error / self.scale) ** self.exponent
        if n < self.early:
            return c2
        c1 = 1.0 if math.isnan(outcome.previous) else max(outcome.previous, self.floor) / error
        return c1 * math.copysign(abs(c2) ** self.power, c2)


@dataclass(frozen=True)
class InformationGain:
    """What the newest sample adds to log det F, with F = I + sum over samples of J^T J / noise^2.

    J are the derivatives of the prediction by the parameters in half-widths of their bounds, at the
    estimate; I stands for what the bounds themselves tell. It rewards knowing the parameters, which
    Eq. (19) does not (a vehicle that sees nothing has small errors too).

    Args:
        noise: standard deviation of a sample's noise [field unit].
    """

    noise: float = 1.0

    def __post_init__(self) -> None:
        checks.positive("noise", self.noise, "field unit")

    def __call__(self, outcome: Outcome) -> float:
        """The reward of the newest sample; raises TypeError for a model without derivatives."""
        model, samples = outcome.problem.model, outcome.problem.samples
        if not isinstance(model, Differentiable):
            raise TypeError(f"{type(model).__name__} has no derivatives; use another reward")
        jacobian = model.jacobian(outcome.theta[None], samples.positions, samples.times)[0]
        scaled = jacobian * model.parameters.half_width / self.noise
        before = np.eye(scaled.shape[1]) + scaled[:-1].T @ scaled[:-1]
        newest = scaled[-1]
        return math.log1p(float(newest @ np.linalg.solve(before, newest)))
