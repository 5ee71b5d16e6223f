"""Bounded least squares by differences from several starts: the baseline for a model without derivatives.

SciPy's trust-region descent on the scaled unknowns u = (theta - theta0) / s, with forward differences. Every
solve is kept among the fit's evaluations, so the folds share them all, and a fold's descent begins at the
solve that serves it best.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fieldrl.core import checks
from fieldrl.core.kinds import component
from fieldrl.estimator.designs import additive_recurrence
from fieldrl.estimator.evaluations import Evaluations, at_centre
from fieldrl.estimator.problem import Fit, FitProblem

_FAR = 1e3  # a failed solve counts as so many times the worst residual


@component
class MultiStart:
    """Least squares by differences from several starts.

    Args:
        starts: descents of fold 0, the first from the centre of the bounds.
        budget: at most so many solves in one descent.
        tolerance: a descent ends when loss or unknowns change relatively by less.
        difference: step of the differences [half-width of the bounds].
        share: with the solves that earlier fits left in the problem; without, fold 0 descends from them too.
        tikhonov: tau >= 0, weight of the pull towards the centre of the bounds [field unit^2].
    """

    starts: int = 8
    budget: int = 60
    tolerance: float = 1e-4
    difference: float = 1e-4
    share: bool = False
    tikhonov: float = 1e-3

    def __post_init__(self) -> None:
        checks.integer("starts", self.starts, 1)
        checks.integer("budget", self.budget, 2)
        checks.between("tolerance", self.tolerance, 1e-12, 0.1)
        checks.between("difference", self.difference, 1e-9, 0.1)
        checks.boolean("share", self.share)
        checks.not_negative("tikhonov", self.tikhonov, "field unit^2")

    def fit(self, problem: FitProblem) -> Fit:
        """Minimisers of every fold among the solves; raises SolveFailed where no solve succeeded."""
        problem = replace(problem, tikhonov=self.tikhonov)
        if not len(problem.samples):
            return at_centre(problem, self.share)
        evaluations = Evaluations(problem, self.share)
        starts, loss = self._starts(problem), np.inf
        gap, converged = np.full(problem.folds, np.inf), np.zeros(problem.folds, dtype=bool)
        for u in starts:
            end = Descent(self, problem, evaluations, 0).run(np.array(u))
            if end.loss < loss:
                loss, gap[0], converged[0] = end
        for fold in range(1, problem.folds):
            descent = Descent(self, problem, evaluations, fold)
            _, gap[fold], converged[fold] = descent.run(descent.best())
        return replace(evaluations.fit(), gap=gap, converged=converged)

    def _starts(self, problem: FitProblem) -> NDArray[np.float64]:
        """Where fold 0 descends from, (k, p) [half-width]: what is known, and all over the bounds."""
        parameters = problem.model.parameters
        spread = additive_recurrence(self.starts, len(parameters))
        if self.share or not len(problem.known):
            return spread
        return np.vstack([(problem.known - parameters.centre) / parameters.half_width, spread])


def fit(problem: FitProblem, starts: int, tikhonov: float = 1e-3, share: bool = False) -> Fit:
    """Least squares by differences from ``starts`` starts, for a model of any kind."""
    return MultiStart(starts=starts, tikhonov=tikhonov, share=share).fit(problem)


class _Spent(Exception):
    """The budget of a descent is used up."""


class End(NamedTuple):
    """Where a descent ended.

    Args:
        loss: there; infinite where it could not begin or its budget was spent [field unit^2].
        gap: what a last Gauss-Newton step would gain; infinite in the same cases [field unit^2].
        converged: whether it ended by its tolerance.
    """

    loss: float = np.inf
    gap: float = np.inf
    converged: bool = False


class Descent:
    """One descent of one fold."""

    def __init__(
        self, settings: MultiStart, problem: FitProblem, evaluations: Evaluations, fold: int
    ) -> None:
        self.settings, self.problem, self.evaluations, self.fold = settings, problem, evaluations, fold
        parameters = problem.model.parameters
        self.centre, self.scale = parameters.centre, parameters.half_width
        self.root_weights = np.sqrt(problem.weights[fold])
        self.limit = evaluations.count + settings.budget

    def run(self, u: NDArray[np.float64]) -> End:
        """Descend from u (p,); the solves are left among the evaluations."""
        if self._solve(u) is None:
            return End()
        inside = np.clip(u, -1.0 + 1e-9, 1.0 - 1e-9)
        try:
            return self._descend(inside, self.settings.tolerance)
        except _Spent:
            return End()

    def _descend(self, u: NDArray, tolerance: float) -> End:
        slope: Any = self._slope  # scipy's stubs know only the names of its own differences
        found: Any = least_squares(
            self._residuals, u, slope, bounds=(-1.0, 1.0), xtol=tolerance, ftol=tolerance, gtol=tolerance
        )
        slopes = found.jac[:, found.active_mask == 0]
        step = np.linalg.lstsq(slopes, -found.fun, rcond=None)[0]
        return End(float(found.fun @ found.fun), float(np.sum((slopes @ step) ** 2)), bool(found.status > 0))

    def best(self) -> NDArray[np.float64]:
        """The solve that serves the fold best, u (p,)."""
        theta = self.evaluations.theta
        if not len(theta):
            return np.zeros_like(self.centre)
        losses = self.problem.losses(self.evaluations.residuals, theta)[:, self.fold]
        return (theta[np.argmin(losses)] - self.centre) / self.scale

    def _solve(self, u: NDArray) -> NDArray[np.float64] | None:
        if self.evaluations.count >= self.limit:
            raise _Spent
        return self.evaluations.ask(self.centre + self.scale * u)

    def _residuals(self, u: NDArray) -> NDArray[np.float64]:
        """Weighted residuals and the roots of the Tikhonov term, (n + p,); far off where the solve fails."""
        residuals = self._solve(u)
        if residuals is None:
            worst = max(1.0, float(np.max(np.abs(self.evaluations.residuals), initial=0.0)))
            residuals = np.full(self.root_weights.size, _FAR * worst)
        return np.concatenate([self.root_weights * residuals, np.sqrt(self.settings.tikhonov) * u])

    def _slope(self, u: NDArray) -> NDArray[np.float64]:
        """Differences away from the nearer bound, (n + p, p); zero where the solve fails."""
        here, columns = self._residuals(u), []
        for k in range(u.size):
            step = -self.settings.difference if u[k] > 0 else self.settings.difference
            moved = u.copy()
            moved[k] += step
            failed = self._solve(moved) is None
            columns.append(np.zeros_like(here) if failed else (self._residuals(moved) - here) / step)
        return np.stack(columns, axis=1)
