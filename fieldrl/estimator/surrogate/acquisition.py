"""Where the next solve of a fit is worth most, and when none is: the acquisition of ``composite``.

In this order: the minimiser of fold 0 until it is known to a small share of its loss, and other minima of it
that may lie lower; a place where a basin may hide that no solve has seen; of the folds of Eq. (5) the minimum
that leaves e_cv most in doubt; folds that are still loose although e_cv is known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from scipy.special import ndtr

from fieldrl.estimator.designs import cover
from fieldrl.estimator.problem import FitProblem
from fieldrl.estimator.surrogate.improvement import basin_volume, improvement_bound
from fieldrl.estimator.surrogate.minima import REACH, Minimum, apart, minima
from fieldrl.estimator.surrogate.predictions import condition, distrusted, evidence, predict_mean

_COVER = 9  # two to this: points of the box
_CAUTION, _MORE_CAUTION = 4.0, 5.0  # for minima, and before it is believed that none is hidden
_SOLVED, _COVERED = (3, 0.02), (10, 0.1)  # starts among solves and cover; how far apart [half-width]
_PRECISE = 0.01  # squared distance from the minimiser that is tolerated [standard deviation^2]
_REPORTED = 10.0  # the loss at the minimiser is known to so many times the tolerance
_HIDDEN, _MARGIN = 0.005, 0.02  # shares of the loss: what a hidden basin may gain, and must to count
_HIDDEN_FLOOR = 0.1  # the least that it gains to count, as a share of the floor
_FEW = 0.2  # share of e_cv that may be in doubt with no more samples than unknowns
_SAME = 1e-6  # closer to a solve than this is the solve [half-width]
_SOLVED_ALREADY = 1e-4  # the same for a fold that leaves a sample out
_AT = 0.01  # solves closer to a minimiser than this share of its move tell nothing of slopes
_LOST = 0.05  # no proposal so near a failed solve [half-width]


class Settings(Protocol):
    """What ``composite`` says of tolerances."""

    @property
    def tolerance(self) -> float: ...

    @property
    def fold_tolerance(self) -> float: ...

    @property
    def floor(self) -> float: ...


class Solves(NamedTuple):
    """k solves: scaled unknowns (k, p), predictions (k, n) [field unit], losses (k, folds) [field unit^2]."""

    u: NDArray[np.float64]
    outputs: NDArray[np.float64]
    losses: NDArray[np.float64]

    def at(self, places: NDArray) -> Solves:
        return Solves(*(rows[places] for rows in self))

    def and_more(self, more: Solves) -> Solves:
        return Solves(*(np.vstack(rows) for rows in zip(self, more, strict=True)))


class Acquisition:
    """Decides on the next solve from those so far; the surrogate is conditioned on the ones ``near``."""

    def __init__(
        self,
        settings: Settings,
        problem: FitProblem,
        known: Solves,
        failed: NDArray[np.float64],
        near: NDArray[np.int64],
    ) -> None:
        self.settings, self.problem, self.known, self.failed = settings, problem, known, failed
        self.p, self.n = len(problem.model.parameters), len(problem.samples)
        self.values, self.tau = problem.samples.values, problem.tikhonov
        self.weights = np.array(problem.weights)
        self.near, self.solves = near, known.at(near)
        self.seen = evidence(self.solves.u, self.solves.outputs, self.values)
        self.surrogate = condition(self.seen, _CAUTION)
        self.box = np.array(cover(_COVER, self.p))
        self._minima: dict[int, list[Minimum]] = {}

    def conditioned_on(self, near: NDArray[np.int64]) -> Acquisition:
        """The same with other solves near."""
        return Acquisition(self.settings, self.problem, self.known, self.failed, near)

    def believing(self, u: NDArray[np.float64]) -> Acquisition:
        """The same with a solve at u (p,) that met the surrogate's mean."""
        parameters, outputs = self.problem.model.parameters, predict_mean(self.surrogate, u[None])
        theta = parameters.centre + parameters.half_width * u[None]
        solve = Solves(u[None], outputs, self.problem.losses(outputs - self.values, theta))
        near = np.append(self.near, len(self.known.u))
        return Acquisition(self.settings, self.problem, self.known.and_more(solve), self.failed, near)

    @property
    def few(self) -> bool:
        """Whether there are no more samples than unknowns."""
        return self.n <= self.p

    @cached_property
    def _box_losses(self) -> NDArray[np.float64]:
        """Losses of the surrogate's mean over the cover, (512, folds)."""
        squares = (predict_mean(self.surrogate, self.box) - self.values) ** 2
        return squares @ self.weights.T + self.tau * np.sum(self.box**2, axis=1)[:, None]

    def minima(self, fold: int) -> list[Minimum]:
        """Of a fold, the lowest first."""
        if fold not in self._minima:
            starts = [
                _lowest(self.solves.u, self.solves.losses[:, fold], *_SOLVED),
                _lowest(self.box, self._box_losses[:, fold], *_COVERED),
            ]
            if fold:
                starts.append(np.array([found.u for found in self.minima(0)[:2]]))
            given = self.surrogate, self.values, self.weights[fold], self.tau, np.concatenate(starts)
            self._minima[fold] = minima(*given, fold)
        return self._minima[fold]

    def next_solve(self) -> NDArray[np.float64] | None:
        """Where the next solve is worth most, u (p,); None where nothing is left in doubt."""
        for found, closest in self._doubtful():
            if self._is_new(found[None], closest)[0] or overlooked(self.known.u, self.near, found).size:
                return found
        return None

    def _doubtful(self) -> Iterator[tuple[NDArray[np.float64], float]]:
        """Candidates, the most urgent first, and how close to a solve each may lie [half-width]."""
        for found in (*self._of_the_full_fit(), *self._hidden()):
            yield found, _SAME
        for found in self._of_the_folds():
            yield found, _SOLVED_ALREADY

    def _of_the_full_fit(self) -> Iterator[NDArray[np.float64]]:
        """The minimiser of fold 0 where it is not known well enough, then minima that may lie lower."""
        best, *others = self.minima(0)
        tolerated = self._tolerated_full()
        if min(best.excess, best.reachable) > tolerated or best.deviation > _REPORTED * tolerated:
            yield self._beside(best)
        if not self.few:
            for other in others:
                if _expected_gain(best, other)[0] > tolerated:
                    yield other.u
                    yield best.u

    def _beside(self, best: Minimum) -> NDArray[np.float64]:
        """The minimiser; or a step aside, where it is as good as solved and its slope is in doubt."""
        move = np.zeros(self.p) if best.move is None else best.move
        step = move * min(1.0, REACH / max(float(np.max(np.abs(move))), _SAME))
        if self._is_new(best.u[None], _AT * float(np.max(np.abs(step))))[0]:
            return best.u
        sides = np.clip(best.u + np.array([[1.0], [-1.0]]) * step, -1.0, 1.0)
        distance = cdist(sides, self.known.u, "chebyshev").min(axis=1)
        return sides[np.argmax(distance)]

    def _hidden(self) -> Iterator[NDArray[np.float64]]:
        """The likeliest place of a basin not yet seen, where all such places together may gain something.

        A point's expected gain says little about a basin much narrower than the distance between points, so
        each point of the cover stands for as many basins as fit into its share of the box. (With no more
        samples than unknowns there are valleys instead, which points do see.)
        """
        best = float(self.known.losses[:, 0].min())
        tolerated = max(_HIDDEN * best, _HIDDEN_FLOOR * self.settings.floor / self.n)
        if best < tolerated or self.few:
            return
        surrogate, box = distrusted(condition(self.seen, _MORE_CAUTION)), self.box
        bound, likely = improvement_bound(surrogate, box, self.values, self.tau, (1.0 - _MARGIN) * best)
        old = ~self._is_new(box)
        bound[old], likely[old] = 0.0, -np.inf
        u = self.solves.u[np.argmin(self.solves.losses[:, 0])]
        basins = max(2.0**self.p / len(box) / basin_volume(surrogate, u, self.tau, best), 1.0)
        if basins * bound.sum() > tolerated:
            yield box[np.argmax(likely)]

    def _of_the_folds(self) -> Iterator[NDArray[np.float64]]:
        """Where e_cv is most in doubt, the worst first, while its error is expected to be too large."""
        doubts = [doubt for fold in range(1, len(self.weights)) for doubt in self._doubts(fold)]
        if not doubts:
            return
        left_out = [self.minima(1 + i)[0].residuals[i] for i in range(self.n)]
        share = max(_FEW, self.settings.fold_tolerance) if self.few else self.settings.fold_tolerance
        tolerated = share * float(np.mean(np.square(left_out)))
        if self.few:
            tolerated = max(tolerated, self.settings.floor)
        if math.sqrt(sum(error**2 for error, _ in doubts)) > tolerated:
            for _, u in sorted(doubts, key=lambda doubt: -doubt[0]):
                yield u
            return
        if not self.few:
            yield from self._of_loose_folds()

    def _of_loose_folds(self) -> Iterator[NDArray[np.float64]]:
        """Minima of folds that are not converged although e_cv is known, the farthest from it first."""
        gaps, tolerated = self.gaps(), self.tolerated()
        for fold in np.argsort(-gaps / tolerated, kind="stable"):
            if fold and gaps[fold] > tolerated[fold]:
                best, *others = self.minima(int(fold))
                yield best.u
                yield from (o.u for o in others if _expected_gain(best, o)[0] > tolerated[fold])

    def _doubts(self, fold: int) -> Iterator[tuple[float, NDArray[np.float64]]]:
        """Expected errors of e_cv by a fold, each with the solve that would tell."""
        best, *others = self.minima(fold)
        residual = best.residuals[fold - 1]
        yield (2 * abs(residual) + best.left_out) * best.left_out / self.n, best.u
        if self.few:
            return
        for other in others:
            _, lower = _expected_gain(best, other)
            error = lower * abs(other.residuals[fold - 1] ** 2 - residual**2) / self.n
            yield error, (other if other.deviation > best.deviation else best).u

    def gaps(self) -> NDArray[np.float64]:
        """How far every fold's loss may lie above its minimum: expected, all minima together, (folds,)."""
        gaps = np.empty(len(self.weights))
        for fold in range(len(gaps)):
            best, *others = self.minima(fold)
            gaps[fold] = best.excess + sum(_expected_gain(best, other)[0] for other in others)
        return gaps

    def tolerated(self) -> NDArray[np.float64]:
        """The gap with which each fold counts as converged, (folds,) [field unit^2]."""
        own = np.array([self.minima(fold)[0].loss for fold in range(len(self.weights))])
        tolerated = self.settings.fold_tolerance * np.maximum(own, own[0])
        tolerated[0] = self._tolerated_full()
        return np.maximum(tolerated, self.settings.floor / self.n) if self.few else tolerated

    def _tolerated_full(self) -> float:
        loss = self.minima(0)[0].loss
        if self.few:
            return max(self.settings.tolerance * loss, self.settings.floor / self.n)
        return loss * min(self.settings.tolerance, _PRECISE / self.n)

    def _is_new(self, candidates: NDArray, closest: float = _SAME) -> NDArray[np.bool_]:
        """Which candidates (m, p) are neither solved nor near a failed solve, (m,)."""
        new = cdist(candidates, self.known.u, "chebyshev").min(axis=1) > closest
        if len(self.failed):
            parameters = self.problem.model.parameters
            lost = (self.failed - parameters.centre) / parameters.half_width
            new &= cdist(candidates, lost, "chebyshev").min(axis=1) > _LOST
        return new


def _expected_gain(best: Minimum, other: Minimum) -> tuple[float, float]:
    """Expected gain by another minimum [field unit^2], and the probability that it lies lower."""
    deviation = math.hypot(best.deviation, other.deviation) + 1e-300
    z = (best.loss - other.loss) / deviation
    lower = float(ndtr(z))
    density = math.exp(-0.5 * min(z * z, 1e3)) / math.sqrt(2 * math.pi)
    return max(deviation * (z * lower + density), 0.0), lower


def _lowest(u: NDArray, losses: NDArray, count: int, gap: float) -> NDArray[np.float64]:
    """The ``count`` points u (m, p) of least loss (m,) that lie farther than ``gap`` apart."""
    return u[apart(u, np.argsort(losses, kind="stable"), count, gap)]


def neighbours(known: Solves, limit: int) -> NDArray[np.int64]:
    """At most ``limit`` places: two thirds the best of every fold by turns, then the farthest from those."""
    u = known.u
    if len(u) <= limit:
        return np.arange(len(u))
    ranks = np.argsort(known.losses, axis=0, kind="stable").ravel()
    _, first = np.unique(ranks, return_index=True)
    chosen = list(ranks[np.sort(first)][: 2 * limit // 3])
    distance = np.min(np.sum((u[:, None] - u[chosen]) ** 2, axis=2), axis=1)
    while len(chosen) < limit:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.sum((u - u[chosen[-1]]) ** 2, axis=1))
    return np.sort(np.array(chosen))


def overlooked(u: NDArray, near: NDArray, found: NDArray) -> NDArray[np.int64]:
    """Known solves (at most four) closer to ``found`` than any that the surrogate was conditioned on."""
    distance = np.max(np.abs(u - found), axis=1)
    closer = np.flatnonzero(distance < distance[near].min())
    return closer[np.argsort(distance[closer], kind="stable")][:4]
