"""How far an estimate may be trusted: standard deviations, intervals, what is identified, misfit.

| symbol | meaning | shape | unit |
|---|---|---|---|
| theta | unknowns | (p,) | each its own |
| u = (theta - theta0) / s | scaled unknowns; the bounds are |u| <= 1 | (p,) | half-width |
| D0, q | least deviance, what it may rise within the interval | | |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.checks import SolveFailed
from fieldrl.core.parameters import Parameters
from fieldrl.estimator.problem import Compiled, Differentiable, FitProblem
from fieldrl.uncertainty.deviance import Deviance
from fieldrl.uncertainty.fisher import Axes, axes
from fieldrl.uncertainty.identifiability import identified, solutions
from fieldrl.uncertainty.misfit import Misfit, misfit
from fieldrl.uncertainty.modes import modes
from fieldrl.uncertainty.noise import Noise
from fieldrl.uncertainty.predictions import predictions
from fieldrl.uncertainty.profile import Profile, profile

LEVEL = 0.95
"""Of every interval that is told."""

_DOUBTFUL = 0.1  # of q: an end of an interval on a surrogate is worth a solve


@dataclass(frozen=True, eq=False)
class Assessment:
    """What is known about an estimate.

    Args:
        parameters: the unknowns.
        estimate: theta of the fit, (p,).
        std: by Fisher information at the estimate, or what the interval about it stands for where that is
            wider, as where the deviance has a kink; infinite where nothing is told, (p,).
        profile: intervals of probability ``level`` [half-width].
        identified: whether the interval is one piece, narrower than half the bounds, (p,).
        axes: principal axes of the estimate's uncertainty [half-width].
        solutions: distinct theta that fit, the best first, (k, p).
        least: D0.
        at_estimate: D at the estimate.
        rise: q of the intervals.
        noise: standard deviations in use; where it was not known, as estimated, (n,) [field unit].
        noise_known: whether it was.
        misfit: tests of the residuals at the best solution.
        solved: parameters that were solved, with those solved for this, (k, p).
        solves: how many were solved for this.
        level: of the intervals.
        deviance: D, by the model or by a surrogate of what was solved.
        stated: the noise as it was stated.
        residuals: prediction minus value at the estimate, 0 where a limit is kept, (n,) [field unit].
    """

    parameters: Parameters
    estimate: NDArray[np.float64]
    std: NDArray[np.float64]
    profile: Profile
    identified: NDArray[np.bool_]
    axes: Axes
    solutions: NDArray[np.float64]
    least: float
    at_estimate: float
    rise: float
    noise: NDArray[np.float64]
    noise_known: bool
    misfit: Misfit
    solved: NDArray[np.float64]
    solves: int
    level: float
    residuals: NDArray[np.float64]
    deviance: Deviance
    stated: Noise

    @property
    def variance(self) -> float:
        """How many times the stated noise's variance the noise has: 1 where it is known."""
        return self.stated.variance(self.least, len(self.parameters))

    def log_likelihood(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of scaled unknowns u (m, p), less its greatest value, (m,); the noise's size integrated out."""
        above = self.deviance.at(u) - self.least
        return self.stated.log_likelihood(above, self.least, len(self.parameters))

    @property
    def interval(self) -> NDArray[np.float64]:
        """Least and greatest value of each unknown, (p, 2)."""
        return self._theta(self.profile.intervals.T).T

    @property
    def pieces(self) -> list[list[tuple[float, float]]]:
        """The separate intervals of each unknown."""
        centre, scale = self.parameters.centre, self.parameters.half_width
        return [
            [(centre[k] + scale[k] * low, centre[k] + scale[k] * high) for low, high in parts]
            for k, parts in enumerate(self.profile.pieces)
        ]

    @property
    def surpassed(self) -> bool:
        """Whether the estimate lies outside the region of what fits: another solution is better."""
        return self.at_estimate > self.least + self.rise

    def _theta(self, u: NDArray) -> NDArray[np.float64]:
        return self.parameters.centre + self.parameters.half_width * u


def assess(
    problem: FitProblem,
    theta: NDArray[np.float64],
    noise: Noise,
    solved: NDArray[np.float64] | None = None,
    solves: int = 0,
    paths: NDArray | None = None,
    level: float = LEVEL,
) -> Assessment:
    """Assess an estimate.

    Args:
        problem: the samples that were fitted, and the model.
        theta: the estimate, (p,).
        noise: of the samples.
        solved: parameters that were solved before, (k, p): for a model without derivatives, of which a
            surrogate is made.
        solves: how many more may be made, where the surrogate leaves an end of an interval in doubt.
        paths: which path each sample belongs to, (n,), for the test of runs; None: one path.
        level: of the intervals, in (0, 1).

    Raises:
        SolveFailed: where not one of ``solved`` can be solved.
    """
    known = np.asarray(theta)[None] if solved is None or not len(solved) else np.asarray(solved)
    assessed = _assess(problem, theta, noise, known, paths, level)
    cheap = isinstance(problem.model, Compiled | Differentiable)
    for used in range(1, solves + 1):
        doubtful = None if cheap else _doubtful(assessed)
        if doubtful is None:
            break
        try:
            problem.residuals(doubtful[None])
        except SolveFailed:
            break
        known = np.vstack([known, doubtful])
        assessed = _assess(problem, theta, noise, known, paths, level, used)
    return assessed


def _deviance_of(problem: FitProblem, noise: Noise, solved: NDArray[np.float64]) -> Deviance:
    """The deviance of a problem's samples, by its model or by a surrogate of ``solved`` (k, p)."""
    samples = problem.samples
    return Deviance(predictions(problem, solved), samples.values, noise.std, samples.censored)


def _assess(
    problem: FitProblem,
    theta: NDArray,
    noise: Noise,
    known: NDArray,
    paths: NDArray | None,
    level: float,
    used: int = 0,
) -> Assessment:
    """Everything from the solves that there are."""
    parameters = problem.model.parameters
    deviance = _deviance_of(problem, noise, known)
    u, p = np.clip((theta - parameters.centre) / parameters.half_width, -1.0, 1.0), len(parameters)
    found = modes(problem, noise, deviance, u)
    least = float(found.deviances[0])
    z, slopes = deviance.linearise(np.stack([u, found.minima[0]]))
    variance, rise = noise.variance(least, p), noise.rise(level, 1, least, p)
    wide = axes(slopes[0], variance)
    fitting = found.fitting(least + rise)
    intervals = profile(deviance, fitting, least, rise, axes(slopes[1], variance).marginal)
    return Assessment(
        parameters=parameters,
        estimate=np.asarray(theta, dtype=float),
        std=_std(wide.marginal, intervals.half_widths(u), rise, variance) * parameters.half_width,
        profile=intervals,
        identified=identified(intervals),
        axes=wide,
        solutions=parameters.centre + parameters.half_width * solutions(intervals, fitting),
        least=least,
        at_estimate=float(z[0] @ z[0]),
        rise=rise,
        noise=noise.std * np.sqrt(variance),
        noise_known=noise.known,
        misfit=misfit(z[1], slopes[1], noise.known, paths),
        solved=known,
        solves=used,
        level=level,
        deviance=deviance,
        stated=noise,
        residuals=z[0] * noise.std,
    )


def _std(fisher: NDArray, half_widths: NDArray, rise: float, variance: float) -> NDArray[np.float64]:
    """The wider standard deviation: Fisher's, or that of a normal estimate with intervals of this width."""
    finite = 0 < variance < np.inf and 0 < rise < np.inf
    return np.maximum(fisher, half_widths / np.sqrt(rise / variance)) if finite else fisher


def _doubtful(assessed: Assessment) -> NDArray[np.float64] | None:
    """The end of an interval that a solve would tell most about, (p,); None where all are known."""
    parameters = assessed.parameters
    ends = assessed.profile.ends.reshape(-1, len(parameters))
    doubts = assessed.deviance.doubt(ends)
    worst = int(np.argmax(doubts))
    if not doubts[worst] > _DOUBTFUL * assessed.rise:
        return None
    return parameters.centre + parameters.half_width * ends[worst]
