"""Composite Bayesian optimisation of all folds at once: the estimator for dear models.

A Gaussian process on the vector of predictions (see ``surrogate``) tells how much every fold's loss may
still gain anywhere. The next solve goes where some fold gains most, counted in what that fold tolerates;
when nothing gains more than is tolerated, each fold's minimiser is the best of the solves.

Candidates are: the surrogate's own minimisers (Gauss-Newton descents on its mean, which end the search in
a few solves once the right basin is found), points around the best solves, and points that cover the box.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from fieldrl.core import checks
from fieldrl.estimator.designs import additive_recurrence, cover, normal_draws
from fieldrl.estimator.improvement import basin_volume, descend, expected_improvement, improvement_bound
from fieldrl.estimator.ledger import Ledger, at_centre
from fieldrl.estimator.problem import Fit, FitProblem
from fieldrl.estimator.surrogate import Evidence, Surrogate, condition, evidence, predict_mean

_COVER, _AROUND, _DRAWS = 9, 4, 6  # two to these: points of the box, points around one, normal vectors
_RADII = (0.1, 0.02, 0.004)  # where to look around the best solves [half-width]
_STARTS = 4  # descents of fold 0 from the best solves, and as many from the best of the cover
_REFINED = (0.05, 0.0125, 0.003)  # where to look around the best candidate [half-width]
_DESCENT = 40  # evaluations of the surrogate in a descent
_MARGIN = 0.02  # a basin not yet seen must be lower by this share to count
_CAUTION, _MORE_CAUTION = 1.0, 3.0  # for the next solve, and before it is believed that none is needed
_SAME = 1e-6  # closer to a solve than this is the solve [half-width]
_LOST = 0.05  # no proposal so near a failed solve [half-width]


@dataclass(frozen=True)
class Composite:
    """Composite expected improvement, one solve at a time.

    Args:
        initial: solves before the surrogate is first asked, >= 2; those already known count.
        budget: at most so many new solves in a fit.
        tolerance: stop when fold 0 expects to gain less than this share of its loss.
        fold_tolerance: the same for each fold that leaves a sample out, as a share of the greater of its own
            loss and fold 0's.
        floor: a gain in the sum of squared residuals less than this is never worth a solve: a small share
            of the variance of a sample's noise [field unit^2].
        share: start from the solves that earlier fits left in the problem.
        neighbours: the surrogate is conditioned on at most so many solves, the best and a few far ones.
        memory: at most so many solves are handed on to later fits, chosen in the same way.
        batch: solves proposed at a time, each as if the others had met the surrogate's mean.
        workers: threads that solve a batch.
        tikhonov: tau >= 0, weight of the pull towards the centre of the bounds [field unit^2].
    """

    initial: int = 4
    budget: int = 60
    tolerance: float = 0.005
    fold_tolerance: float = 0.07
    floor: float = 0.1
    share: bool = True
    neighbours: int = 60
    memory: int = 250
    batch: int = 1
    workers: int = 1
    tikhonov: float = 1e-3

    def __post_init__(self) -> None:
        for name, least in (
            ("initial", 2),
            ("budget", 1),
            ("neighbours", 10),
            ("memory", 10),
            ("batch", 1),
            ("workers", 1),
        ):
            checks.integer(name, getattr(self, name), least)
        checks.positive("tolerance", self.tolerance)
        checks.positive("fold_tolerance", self.fold_tolerance)
        checks.positive("floor", self.floor, "field unit^2")
        checks.boolean("share", self.share)
        checks.not_negative("tikhonov", self.tikhonov, "field unit^2")

    def fit(self, problem: FitProblem) -> Fit:
        """Minimisers of every fold among the solves; raises SolveFailed where no solve succeeded."""
        problem = replace(problem, tikhonov=self.tikhonov)
        if not len(problem.samples):
            return at_centre(problem, self.share)
        ledger = Ledger(problem, self.share, self.workers)
        search = _Search(self, problem, ledger)
        search.begin()
        while ledger.evaluations < self.budget:
            proposals = search.propose(min(self.batch, self.budget - ledger.evaluations))
            if not proposals:
                break
            ledger.ask_all(proposals)
        return search.hand_on(ledger.fit())


class _Solves(NamedTuple):
    """k solves: scaled unknowns (k, p), predictions (k, n) [field unit], losses (k, folds) [field unit^2]."""

    u: NDArray[np.float64]
    outputs: NDArray[np.float64]
    losses: NDArray[np.float64]

    def at(self, places: NDArray) -> _Solves:
        return _Solves(*(rows[places] for rows in self))

    def and_more(self, more: _Solves) -> _Solves:
        return _Solves(*(np.vstack(rows) for rows in zip(self, more, strict=True)))


class _Search:
    """The proposals of one fit."""

    def __init__(self, settings: Composite, problem: FitProblem, ledger: Ledger) -> None:
        self.settings, self.problem, self.ledger = settings, problem, ledger
        parameters = problem.model.parameters
        self.centre, self.scale, self.p = parameters.centre, parameters.half_width, len(parameters)
        self.weights = np.array(problem.weights)

    def begin(self) -> None:
        """Solve the initial design, less what is known; its first point is theta0."""
        settings = self.settings
        design = additive_recurrence(settings.budget, self.p)
        for u in design:
            if len(self.ledger.theta) >= settings.initial or self.ledger.evaluations >= settings.budget:
                break
            self.ledger.ask(self._theta(u))

    def hand_on(self, fit: Fit) -> Fit:
        """The fit, with no more known solves than memory allows."""
        if not self.settings.share or len(fit.known) <= self.settings.memory:
            return fit
        return replace(fit, known=fit.known[_neighbours(self._known(), self.settings.memory)])

    def propose(self, count: int) -> list[NDArray[np.float64]]:
        """Where to solve next, at most ``count`` theta (p,); empty where nothing is worth a solve."""
        known = self._known()
        best = known.losses.min(axis=0)
        tolerated, near = self._tolerated(best), _neighbours(known, self.settings.neighbours)
        solves, proposals = known.at(near), []
        while len(proposals) < count:
            seen = evidence(solves.u, solves.outputs, self.problem.samples.values)
            found = self._most_worthwhile(seen, solves.losses, best, tolerated)
            if found is None:
                found = self._unexplored(seen, solves.losses, best[0], tolerated[0])
            if found is None:
                break
            overlooked = _overlooked(known.u, near, found)
            if overlooked.size:
                near, solves = np.append(near, overlooked), solves.and_more(known.at(overlooked))
                continue
            proposals.append(self._theta(found))
            if len(proposals) < count:
                solves = solves.and_more(self._believed(seen, found))
        return proposals

    def _believed(self, seen: Evidence, found: NDArray) -> _Solves:
        """A solve at ``found`` that met the surrogate's mean."""
        outputs = predict_mean(condition(seen, _CAUTION), found[None])
        losses = self.problem.losses(outputs - seen.values, self._theta(found)[None])
        return _Solves(found[None], outputs, losses)

    def _most_worthwhile(
        self, seen: Evidence, losses: NDArray, best: NDArray, tolerated: NDArray
    ) -> NDArray[np.float64] | None:
        """The candidate with the greatest gain in units of what is tolerated, refined; None below 1."""
        values, draws = seen.values, normal_draws(_DRAWS, len(seen.values))
        surrogate = condition(seen, _CAUTION)

        def worth(candidates: NDArray) -> tuple[NDArray, float]:
            candidates = candidates[self._is_new(candidates, seen.inputs)]
            if not len(candidates):
                return candidates, 0.0
            gains = expected_improvement(surrogate, candidates, values, self.settings.tikhonov, best, draws)
            most = np.max(gains / tolerated, axis=1)
            return candidates[np.argmax(most)], float(most.max())

        found, most = worth(self._candidates(surrogate, losses))
        for radius in _REFINED:
            if most > 0.0:
                found, most = worth(np.concatenate([found[None], self._around(found, radius)]))
        return found if most > 1.0 else None

    def _unexplored(
        self, seen: Evidence, losses: NDArray, best: float, tolerated: float
    ) -> NDArray[np.float64] | None:
        """The likeliest place of a basin not yet seen; None where all such places together gain little.

        A point's expected gain says little about a basin much narrower than the distance between points, so
        each point of the cover stands for as many basins as fit into its share of the box. (With no more
        samples than unknowns there are valleys instead, which points do see.)
        """
        if best < tolerated or len(self.problem.samples) <= self.p:
            return None
        u, tau, box = seen.inputs, self.settings.tikhonov, cover(_COVER, self.p)
        surrogate = condition(seen, _MORE_CAUTION)
        bound = improvement_bound(surrogate, box, seen.values, tau, (1.0 - _MARGIN) * best)
        bound[~self._is_new(box, u)] = 0.0
        narrow = basin_volume(surrogate, u[np.argmin(losses[:, 0])], tau, best)
        basins = max(2.0**self.p / len(box) / narrow, 1.0)
        return box[np.argmax(bound)] if basins * bound.sum() > tolerated else None

    def _candidates(self, surrogate: Surrogate, losses: NDArray) -> NDArray[np.float64]:
        """Minimisers of the surrogate, the neighbourhoods of the best solves, and the cover, (m, p)."""
        u, box = surrogate.inputs, cover(_COVER, self.p)
        order = np.argsort(losses[:, 0], kind="stable")
        incumbents = np.unique(np.concatenate([np.argmin(losses, axis=0), order[:3]]))
        around = [self._around(u[i], radius) for i in incumbents for radius in _RADII]
        return np.concatenate([self._minimisers(surrogate, losses, order), *around, box])

    def _minimisers(self, surrogate: Surrogate, losses: NDArray, order: NDArray) -> NDArray[np.float64]:
        """Where descents on the surrogate end: fold 0 from several starts, the others from their best."""
        values, tau, box = self.problem.samples.values, self.settings.tikhonov, cover(_COVER, self.p)
        u, expected = surrogate.inputs, np.sum((predict_mean(surrogate, box) - values) ** 2, axis=1)
        starts = [(0, u[i]) for i in order[:_STARTS]]
        starts += [(0, box[i]) for i in np.argsort(expected, kind="stable")[:_STARTS]]
        starts += [(fold, u[i]) for fold, i in enumerate(np.argmin(losses, axis=0)) if fold]
        ends = np.array([start for _, start in starts])
        for end, (fold, _) in zip(ends, starts, strict=True):
            descend(surrogate, values, self.weights[fold], tau, end, _DESCENT)
        return ends

    def _is_new(self, candidates: NDArray, u: NDArray) -> NDArray[np.bool_]:
        """Which candidates (m, p) are neither solved nor near a failed solve, (m,)."""
        new = cdist(candidates, u, "chebyshev").min(axis=1) > _SAME
        for lost in (self.ledger.failed - self.centre) / self.scale:
            new &= np.max(np.abs(candidates - lost), axis=1) > _LOST
        return new

    def _around(self, u: NDArray, radius: float) -> NDArray[np.float64]:
        return np.clip(u + radius * cover(_AROUND, self.p), -1.0, 1.0)

    def _known(self) -> _Solves:
        """All solves that did not fail."""
        theta, residuals = self.ledger.theta, self.ledger.residuals
        outputs, losses = residuals + self.problem.samples.values, self.problem.losses(residuals, theta)
        return _Solves((theta - self.centre) / self.scale, outputs, losses)

    def _tolerated(self, best: NDArray) -> NDArray[np.float64]:
        """What each fold may be above its minimum; a fold that fits by chance is not held to its own loss."""
        tolerated = self.settings.fold_tolerance * np.maximum(best, best[0])
        tolerated[0] = self.settings.tolerance * best[0]
        return np.maximum(tolerated, self.settings.floor / len(self.problem.samples))

    def _theta(self, u: NDArray) -> NDArray[np.float64]:
        return self.centre + self.scale * u


def _neighbours(known: _Solves, limit: int) -> NDArray[np.int64]:
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


def _overlooked(u: NDArray, near: NDArray, found: NDArray) -> NDArray[np.int64]:
    """Known solves (at most four) closer to ``found`` than any that the surrogate was conditioned on."""
    distance = np.max(np.abs(u - found), axis=1)
    closer = np.flatnonzero(distance < distance[near].min())
    return closer[np.argsort(distance[closer], kind="stable")][:4]
