"""One mission judged: what its intervals, regions and tests say, beside what is true.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns (theta - theta0) / s | (p,) |
| D, D0 | deviance, its least value | |
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import Compiled, Differentiable, FitProblem
from fieldrl.mission.uncertainty_record import SOLVES
from fieldrl.uncertainty import Assessment, Noise, assess, draws, field_std
from fieldrl.uncertainty.fisher import axes
from fieldrl.uncertainty.profile import constrained
from pipelines.calibration.missions import SIZES, Simulated, World
from pipelines.calibration.wrong import WRONG, WRONG_EVERY

LEVELS = (0.5, 0.8, 0.95)
NEARLY_ALL = 0.9999
"""A path is informative for a truth where the interval of this probability, of the values without noise, is
one piece, narrower than half the bounds, and within them: noise hardly ever takes the estimate elsewhere."""

SEEN = 0.05
"""A band of the field is looked at where its standard deviation is more than this share of the noise's."""

_STEP = 0.01  # of a central difference [half-width]


def judge(world: World, number: int) -> list[dict[str, Any]]:
    """Mission ``number`` of a world, one row for each of ``SIZES``."""
    simulated, known, rows = world.drawn(number), np.empty((0, len(world.water.parameters))), []
    slopes = _slopes(world, simulated)
    for n in SIZES:
        case = _Case(world, simulated, n, known)
        rows.append(
            {"mission": number, "n": n, "truth": case.truth.tolist()}
            | case.told()
            | case.informative(slopes[:n])
            | case.straight(slopes[:n])
            | case.without_the_noise_s_size()
        )
        known = case.known
    rows[-1] |= case.field()
    if number % WRONG_EVERY[world.experiment] == 0:
        changes = WRONG[world.experiment].items()
        rows[-1] |= {f"wrong {name}": case.wrong(change(world, simulated)) for name, change in changes}
    return rows


class _Case:
    """The first n samples of a mission, fitted from the solves ``known`` (k, p)."""

    def __init__(self, world: World, simulated: Simulated, n: int, known: NDArray) -> None:
        self.world, self.simulated, self.n = world, simulated, n
        self.parameters = world.water.parameters
        self.truth = (simulated.truth - self.parameters.centre) / self.parameters.half_width
        self.noise = Noise(np.full(n, world.noise), True)
        self.known = known
        self.samples = simulated.samples(n)
        self.assessed = self._assess(self.samples)
        self.known = self.assessed.solved[1:]  # the first is the estimate

    def _assess(self, samples: Samples) -> Assessment:
        """Fit and assess, as a mission does."""
        problem = self._problem(samples)
        fit = self.world.mission.estimator.fit(problem)
        solved = np.vstack([fit.theta[:1], fit.known])
        return assess(problem, fit.theta[0], self.noise, solved, SOLVES, self.simulated.paths[: self.n])

    def _again(self, level: float, noise: Noise) -> Assessment:
        """The same estimate at another level or with other knowledge of the noise."""
        first = self.assessed
        paths = self.simulated.paths[: self.n]
        return assess(self._problem(self.samples), first.estimate, noise, first.solved, 0, paths, level)

    def _problem(self, samples: Samples) -> FitProblem:
        tikhonov = self.world.mission.estimator.tikhonov
        return FitProblem(self.simulated.water, samples, tikhonov, False, self.known)

    def told(self) -> dict[str, Any]:
        """Estimate, intervals and regions, and whether they hold the truth."""
        found, p = self.assessed, len(self.parameters)
        again = {level: found if level == LEVELS[-1] else self._again(level, self.noise) for level in LEVELS}
        above = float(found.deviance.at(self.truth[None])[0]) - found.least
        estimate = (found.estimate - self.parameters.centre) / self.parameters.half_width
        return {
            "estimate": estimate.tolist(),
            "std": (found.std / self.parameters.half_width).tolist(),
            "width": (np.diff(found.interval, axis=1)[:, 0] / self.parameters.half_width).tolist(),
            "identified": found.identified.tolist(),
            "surpassed": found.surpassed,
            "covered": [holds(again[level], self.simulated.truth) for level in LEVELS],
            "region": [above <= self.noise.rise(level, p, found.least, p) for level in LEVELS],
            "rank": [self._rank(k, above) for k in range(p)],
            "p": found.misfit.p,
            "solves": found.solves,
        }

    def _rank(self, k: int, above: float) -> float:
        """The truth's place in the distribution that the profile tells: uniform if that is true."""
        found, least = self.assessed, self.assessed.least
        scaled = (found.solutions - self.parameters.centre) / self.parameters.half_width
        starts = np.vstack([scaled, self.truth])
        risen = min(
            above, *(constrained(found.deviance, u, k, self.truth[k : k + 1])[0] - least for u in starts)
        )
        return float(ndtr(np.sign(self.truth[k] - scaled[0, k]) * np.sqrt(max(risen, 0.0))))

    def informative(self, slopes: NDArray) -> dict[str, Any]:
        """Cramer-Rao's bound at the truth, from J (n, p); whether the path is informative; without any noise.

        ``normal`` is how many times wider the interval is than a normal likelihood of that bound has it.
        """
        simulated = self.simulated
        problem = self._problem(simulated.samples(self.n, simulated.clean))
        solved = np.vstack([simulated.truth, self.assessed.solved])
        clean = assess(problem, simulated.truth, self.noise, solved, level=NEARLY_ALL)
        inside = np.abs(clean.profile.intervals).max() < 1.0
        bound = axes(slopes).marginal
        normal = np.diff(clean.profile.intervals, axis=1)[:, 0] / (2.0 * np.sqrt(clean.rise) * bound)
        return {
            "bound": bound.tolist(),
            "normal": normal.tolist(),
            "informative": bool(clean.identified.all() and inside),
        }

    def straight(self, slopes: NDArray) -> dict[str, Any]:
        """Whether intervals would hold the truth if the model were straight, as J (n, p) has it there.

        For such a model they are exact: what these miss with the same noise is the luck of the noise.
        """
        off = np.linalg.lstsq(slopes, self.simulated.noise[: self.n] / self.world.noise, rcond=None)[0]
        bound, reach = axes(slopes).marginal, ndtri(0.5 + np.array(LEVELS) / 2.0)
        return {"straight": [(np.abs(off) <= end * bound).tolist() for end in reach]}

    def field(self) -> dict[str, Any]:
        """How much of the true field at the end lies in the pointwise band of 95 % about the estimated one.

        Shares of the cells: of all, and of those whose band is wider than ``SEEN``; and how many these are.
        """
        water, found, duration = self.simulated.water, self.assessed, self.world.mission.duration
        truth = water.truth()
        true, estimate = (
            model.field(theta, duration, truth.grid)
            for model, theta in ((truth, self.simulated.truth), (water, found.estimate))
        )
        theta = self.parameters.centre + self.parameters.half_width * draws(found)
        std = field_std(water, estimate, theta, duration, truth.grid, found.solved)
        held, seen = np.abs(estimate - true) <= ndtri(0.975) * std, std > SEEN * self.world.noise
        share = float(held[seen].mean()) if seen.any() else None
        off = float(np.sqrt(np.mean((estimate - true) ** 2)))
        told = float(np.sqrt(np.mean(std**2)))
        return {"field": [float(held.mean()), share, float(seen.mean())], "field rms": [off, told]}

    def without_the_noise_s_size(self) -> dict[str, Any]:
        """The interval of 95 % where the size of the noise follows from the residuals."""
        found = self._again(LEVELS[-1], Noise(self.noise.std, False))
        return {"unknown covered": holds(found, self.simulated.truth), "unknown p": found.misfit.p}

    def wrong(self, values: NDArray) -> list[float]:
        """Of values that the model cannot explain: size of the misfit that no fit removes, and p with noise.

        The size is the root mean square of the residuals without noise at their best fit [std of the noise].
        """
        noisy = self._assess(self.simulated.samples(self.n, values + self.simulated.noise))
        problem = self._problem(self.simulated.samples(self.n, values))
        clean = assess(problem, noisy.estimate, self.noise, noisy.solved, SOLVES)
        return [float(np.sqrt(clean.least / self.n)), noisy.misfit.p]


def holds(assessed: Assessment, truth: NDArray) -> list[bool]:
    """Whether the intervals hold the truth (p,)."""
    return [
        any(low <= value <= high for low, high in pieces)
        for value, pieces in zip(truth, assessed.pieces, strict=True)
    ]


def _slopes(world: World, simulated: Simulated) -> NDArray[np.float64]:
    """J of the standardised residuals by u at the truth, (n, p); by central differences of a dear model."""
    water, scale, truth = simulated.water, world.water.parameters.half_width, simulated.truth
    at = simulated.positions, simulated.times
    if isinstance(water, Compiled | Differentiable):
        slopes = water.jacobian(truth[None], *at)[0] * scale  # pyright: ignore[reportAttributeAccessIssue]
    else:
        shifts = _STEP * np.diag(scale)
        ahead, behind = (water.predict(truth + side * shifts, *at) for side in (1, -1))
        slopes = (ahead - behind).T / (2 * _STEP)
    return slopes / world.noise
