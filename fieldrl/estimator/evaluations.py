"""The solves of one fit: what was asked, what came back, what each fold makes of it.

One solve gives the residuals at all samples and thus the loss of every fold. The store opens with the
solves that the problem already knows (they cost nothing) and counts the new ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from fieldrl.core.checks import SolveFailed
from fieldrl.estimator.problem import Fit, FitProblem, Optimisation


class Evaluations:
    """Solves by theta, in the order in which they were asked.

    Args:
        problem: what is fitted.
        share: open with the solves of ``problem.known``.
        workers: threads that solve a batch.
    """

    def __init__(self, problem: FitProblem, share: bool = False, workers: int = 1) -> None:
        self.problem, self.share, self.workers = problem, share, workers
        self._places: dict[bytes, int] = {}
        self._theta: list[NDArray] = []
        self._residuals: list[NDArray | None] = []
        self._error: SolveFailed | None = None
        if share and len(problem.known):
            self._open(np.ascontiguousarray(problem.known, dtype=float))
        self.opening = len(self._theta)

    @property
    def count(self) -> int:
        """New solves so far, failed ones included."""
        return len(self._theta) - self.opening

    @property
    def theta(self) -> NDArray[np.float64]:
        """What was solved without failing, (k, p)."""
        return _rows([self._theta[i] for i in self._solved()], len(self.problem.model.parameters))

    @property
    def residuals(self) -> NDArray[np.float64]:
        """Prediction - value there, (k, n) [field unit]."""
        return _rows([self._residuals[i] for i in self._solved()], len(self.problem.samples))

    @property
    def failed(self) -> NDArray[np.float64]:
        """Where the solve failed, (f, p)."""
        lost = [t for t, r in zip(self._theta, self._residuals, strict=True) if r is None]
        return _rows(lost, len(self.problem.model.parameters))

    def ask(self, theta: NDArray) -> NDArray[np.float64] | None:
        """Residuals at theta (p,): (n,) [field unit], or None where the solve fails."""
        return self.ask_all([theta])[0]

    def ask_all(self, thetas: Sequence[NDArray]) -> list[NDArray[np.float64] | None]:
        """Residuals at several theta (p,), solved by ``workers`` threads; nothing is solved twice."""
        new: dict[bytes, NDArray] = {}
        for theta in thetas:
            if theta.tobytes() not in self._places:
                new.setdefault(theta.tobytes(), np.array(theta, dtype=float))
        if self.workers > 1 and len(new) > 1:
            pool = Parallel(n_jobs=self.workers, prefer="threads")
            answers: list[Any] = list(pool(delayed(self._solve)(theta) for theta in new.values()))
        else:
            answers = [self._solve(theta) for theta in new.values()]
        for theta, answer in zip(new.values(), answers, strict=True):
            self._write(theta, answer)
        return [self._residuals[self._places[theta.tobytes()]] for theta in thetas]

    def fit(self) -> Fit:
        """The best solve of every fold, its gap unsaid; raises SolveFailed where no solve succeeded."""
        theta, residuals = self.theta, self.residuals
        if not len(theta):
            raise self._error or SolveFailed((), 0.0, "nothing was solved")
        losses = self.problem.losses(residuals, theta)
        best, folds = np.argmin(losses, axis=0), np.arange(losses.shape[1])
        known = theta if self.share else self.problem.known
        told = self.count, known, self.course()
        unsaid = np.full(len(best), np.nan), np.zeros(len(best), dtype=bool)
        return Fit(theta[best], losses[best, folds], residuals[best], *told, *unsaid)

    def course(self) -> Optimisation:
        """The new solves in order, with the loss of fold 0."""
        theta = _rows(self._theta[self.opening :], len(self.problem.model.parameters))
        return Optimisation(theta, np.array([self._loss(i) for i in range(self.opening, len(self._theta))]))

    def _loss(self, i: int) -> float:
        residuals = self._residuals[i]
        if residuals is None:
            return float("nan")
        return float(self.problem.losses(residuals[None], self._theta[i][None])[0, 0])

    def _solved(self) -> list[int]:
        return [i for i, residuals in enumerate(self._residuals) if residuals is not None]

    def _open(self, known: NDArray) -> None:
        """Write what the problem knows: one prediction, or one for each theta if some solve fails now."""
        try:
            residuals = self.problem.residuals(known)
        except SolveFailed:
            for theta in known:
                answer = self._solve(theta)
                if not isinstance(answer, SolveFailed):
                    self._write(theta, answer)
            return
        whole = np.atleast_1d(np.isfinite(residuals).all(axis=1)).tolist()
        for theta, row, good in zip(known, residuals, whole, strict=True):
            self._keep(theta, row if good else None)

    def _solve(self, theta: NDArray) -> NDArray | SolveFailed:
        try:
            return self.problem.residuals(theta[None])[0]
        except SolveFailed as error:
            return error

    def _write(self, theta: NDArray, answer: NDArray | SolveFailed) -> None:
        if isinstance(answer, SolveFailed) or not np.all(np.isfinite(answer)):
            self._error = answer if isinstance(answer, SolveFailed) else None
            self._keep(theta, None)
        else:
            self._keep(theta, answer)

    def _keep(self, theta: NDArray, residuals: NDArray | None) -> None:
        if theta.tobytes() not in self._places:
            self._places[theta.tobytes()] = len(self._theta)
            self._theta.append(theta)
            self._residuals.append(residuals)


def at_centre(problem: FitProblem, share: bool) -> Fit:
    """The fit of no samples: theta0, solved."""
    evaluations = Evaluations(problem, share)
    evaluations.ask(problem.model.parameters.centre)
    return replace(evaluations.fit(), gap=np.zeros(1), converged=np.ones(1, dtype=bool))


def _rows(rows: list, width: int) -> NDArray[np.float64]:
    """A list of vectors as an array, (k, width) even where it is empty."""
    return np.array(rows, dtype=float).reshape(len(rows), width)
