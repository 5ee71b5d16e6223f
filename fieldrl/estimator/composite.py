"""Composite Bayesian optimisation of all folds: the estimator for dear models.

A Gaussian process on the vector of predictions (see ``surrogate``) gives every fold's loss anywhere, and how
far that may be trusted (see ``minima``). Solves are made where they settle most (see ``acquisition``): first
fold 0, then the folds of Eq. (5), each refitted on the surrogate. A minimiser is solved where that is needed,
and read from the surrogate where it is known well enough without; the fit says how well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.cost import DOUBLE, Cost, Extent, solve_seconds
from fieldrl.core.kinds import component
from fieldrl.estimator.designs import additive_recurrence
from fieldrl.estimator.evaluations import Evaluations, at_centre
from fieldrl.estimator.problem import Fit, FitProblem, ForwardModel
from fieldrl.estimator.surrogate.acquisition import Acquisition, Solves, neighbours, overlooked

_SOLVES = 2.0  # of a fit, typically, when earlier ones are known
_EACH, _AT_LEAST = 30, 60  # solves for each unknown, and in all, where that is left to the estimator
_LEAST = {"initial": 2, "budget": 1, "neighbours": 10, "memory": 10, "batch": 1, "workers": 1}
_PROPOSAL, _SAMPLE = 4e-3, 4e-4  # time of a proposal, and for each sample in it [s]


@component
class Composite:
    """Composite Bayesian optimisation, one solve at a time.

    With no more samples than unknowns every fold has a valley instead of a minimum, and the penalty decides;
    there ``floor`` keeps solves from being spent.

    Args:
        initial: solves before the surrogate is first asked, >= 2; those already known count.
        budget: at most so many new solves in a fit; None: 30 for each unknown, 60 at least.
        tolerance: fold 0 ends within this share of its least loss (and within a tenth of a standard deviation
            of its minimiser).
        fold_tolerance: the folds end when e_cv is known to this share.
        floor: with few samples, an error in the sum of squared residuals less than this is never worth a
            solve; nor is a hidden basin that gains less [field unit^2].
        share: start from the solves that earlier fits left in the problem.
        neighbours: the surrogate is conditioned on at most so many solves, the best and a few far ones; None:
            30 for each unknown, 60 at least.
        memory: at most so many solves are handed on to later fits, chosen in the same way.
        batch: solves proposed at a time, each as if the others had met the surrogate's mean.
        workers: threads that solve a batch.
        tikhonov: tau >= 0, weight of the pull towards the centre of the bounds [field unit^2].
    """

    initial: int = 4
    budget: int | None = None
    tolerance: float = 0.0003
    fold_tolerance: float = 0.01
    floor: float = 0.1
    share: bool = True
    neighbours: int | None = None
    memory: int = 250
    batch: int = 1
    workers: int = 1
    tikhonov: float = 1e-3

    def __post_init__(self) -> None:
        for name, least in _LEAST.items():
            if getattr(self, name) is not None or name not in ("budget", "neighbours"):
                checks.integer(name, getattr(self, name), least)
        checks.positive("tolerance", self.tolerance)
        checks.positive("fold_tolerance", self.fold_tolerance)
        checks.positive("floor", self.floor, "field unit^2")
        checks.boolean("share", self.share)
        checks.not_negative("tikhonov", self.tikhonov, "field unit^2")

    def cost(self, extent: Extent, model: ForwardModel) -> Cost:
        """The surrogate of all samples' predictions at the end, and the proposals and solves until then."""
        n, pooled = extent.steps, extent.samples
        budget, most = (_limit(given, extent.parameters) for given in (self.budget, self.neighbours))
        near = min(most, budget + self.memory * self.share, budget * pooled) + 4
        solves = min(max(self.initial / n, _SOLVES), budget)
        propose = (_PROPOSAL + _SAMPLE * n) * (1 + (near / 64) ** 2) / 2
        course = 4 * pooled * budget * (2 + extent.parameters)
        memory = DOUBLE * (pooled * (near**2 + 6000) + 20 * budget + 3 * self.memory * n + course)
        one = solve_seconds(model, n)
        seconds = pooled * ((solves + 1) * propose + solves * one) + pooled * near**2 * 1e-6
        return Cost(memory, seconds, by=("budget", "initial", "neighbours", "memory"))

    def fit(self, problem: FitProblem) -> Fit:
        """Minimisers of every fold; raises SolveFailed where no solve succeeded."""
        problem = replace(problem, tikhonov=self.tikhonov)
        if not len(problem.samples):
            return at_centre(problem, self.share)
        evaluations, p = Evaluations(problem, self.share, self.workers), len(problem.model.parameters)
        budget, most = _limit(self.budget, p), _limit(self.neighbours, p)
        _begin(problem, evaluations, self.initial, budget)
        while True:
            known = _known(problem, evaluations)
            acquisition = Acquisition(self, problem, known, evaluations.failed, neighbours(known, most))
            proposals, acquisition = _propose(acquisition, min(self.batch, budget - evaluations.count))
            if not proposals:
                return self._conclude(acquisition, evaluations)
            evaluations.ask_all(proposals)

    def _conclude(self, acquisition: Acquisition, evaluations: Evaluations) -> Fit:
        """The fit: minimisers on the surrogate where they are known well enough, else the best solves."""
        solved, parameters = evaluations.fit(), acquisition.problem.model.parameters
        theta, loss, residuals = solved.theta.copy(), solved.loss.copy(), solved.residuals.copy()
        gap, tolerated = acquisition.gaps(), acquisition.tolerated()
        converged = gap <= tolerated
        for fold in np.flatnonzero(converged):
            found = acquisition.minima(int(fold))[0]
            theta[fold] = parameters.centre + parameters.half_width * found.u
            loss[fold], residuals[fold] = found.loss, found.residuals
        known = solved.known
        if self.share and len(known) > self.memory:
            known = known[neighbours(acquisition.known, self.memory)]
        return replace(
            solved, theta=theta, loss=loss, residuals=residuals, known=known, gap=gap, converged=converged
        )


def _limit(given: int | None, unknowns: int) -> int:
    """Of solves: as given, or what so many unknowns need."""
    return max(_EACH * unknowns, _AT_LEAST) if given is None else given


def _begin(problem: FitProblem, evaluations: Evaluations, initial: int, budget: int) -> None:
    """Solve the initial design, less what is known; its first point is theta0."""
    parameters = problem.model.parameters
    for u in additive_recurrence(budget, len(parameters)):
        if len(evaluations.theta) >= initial or evaluations.count >= budget:
            break
        evaluations.ask(parameters.centre + parameters.half_width * u)
    if not len(evaluations.theta):
        evaluations.fit()  # raises what the solves raised


def _known(problem: FitProblem, evaluations: Evaluations) -> Solves:
    """All solves that did not fail."""
    theta, residuals, parameters = evaluations.theta, evaluations.residuals, problem.model.parameters
    u = (theta - parameters.centre) / parameters.half_width
    return Solves(u, residuals + problem.samples.values, problem.losses(residuals, theta))


def _propose(acquisition: Acquisition, count: int) -> tuple[list[NDArray[np.float64]], Acquisition]:
    """Where to solve next, at most ``count`` theta (p,), none where nothing is in doubt; and what says so."""
    proposals, parameters, current = [], acquisition.problem.model.parameters, acquisition
    while len(proposals) < count:
        found = current.next_solve()
        if found is None:
            break
        left_out = overlooked(current.known.u, current.near, found)
        if left_out.size:
            current = current.conditioned_on(np.append(current.near, left_out))
            acquisition = acquisition if proposals else current
            continue
        proposals.append(parameters.centre + parameters.half_width * found)
        if len(proposals) < count:
            current = current.believing(found)
    return proposals, acquisition
