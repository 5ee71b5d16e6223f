"""Nonlinear least squares for every fold: the estimator for cheap models.

A compiled model (see ``problem.Compiled``) is fitted by the compiled Levenberg-Marquardt; any other by
SciPy's bounded least squares from several starts.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.estimator.coarse_search import axis_neighbours, box_grid
from fieldrl.estimator.global_fit import global_fit, global_fits, local_fits
from fieldrl.estimator.problem import Compiled, Fit, FitProblem, ForwardModel


@dataclass
class _Search:
    """A model's coarse grid with the squared residuals of the samples seen last: a memo."""

    model: tuple[int, NDArray, NDArray, NDArray]
    grid: NDArray[np.float64]
    theta: NDArray[np.float64]
    neighbours: NDArray[np.int64]
    cell: float
    memo: tuple[NDArray, NDArray, NDArray, NDArray]

    def reserve(self, n: int) -> None:
        """Room for n samples."""
        if n > len(self.memo[0]):
            self.memo = _memo(max(2 * len(self.memo[0]), n, 32), len(self.grid))


def _memo(capacity: int, size: int) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Labels (capacity, 4), squared residuals, running sums and maxima (capacity, size)."""
    squared, total, largest = np.empty((3, capacity, size))
    return np.full((capacity, 4), np.nan), squared, total, largest


@dataclass(frozen=True)
class LeastSquares:
    """Levenberg-Marquardt on all folds.

    Args:
        starts: 1 descends once, from the centre of the bounds, as a local optimiser does; more descend
            from so many of the lowest minima of a coarse grid, to the global minimum.
        grid: points of the coarse grid along each parameter.
        tikhonov: tau >= 0, weight of the pull towards the centre of the bounds [field unit^2].
        iterations: at most so many evaluations in one descent.
        tolerance: a step that moves no parameter by more is the last, in half-widths of the bounds.
    """

    starts: int = 4
    grid: int = 31
    tikhonov: float = 1e-3
    iterations: int = 2000
    tolerance: float = 1e-7
    _searches: dict = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        checks.integer("starts", self.starts, 1)
        checks.integer("grid", self.grid, 3)
        checks.not_negative("tikhonov", self.tikhonov, "field unit^2")
        checks.integer("iterations", self.iterations, 1)
        checks.positive("tolerance", self.tolerance)

    def fit(self, problem: FitProblem) -> Fit:
        """Minimisers of every fold; raises SolveFailed where every solve of a model by differences fails."""
        search = self._search(problem.model)
        if search is None:
            from fieldrl.estimator.multi_start import MultiStart  # SciPy's optimisers take long to import

            return MultiStart(starts=self.starts, tikhonov=self.tikhonov).fit(problem)
        samples, weights = problem.samples, problem.weights
        folds, n = weights.shape
        u, loss, residuals = np.empty((folds, search.grid.shape[1])), np.empty(folds), np.empty((folds, n))
        what = search.model, (samples.positions, samples.times, samples.values), self.tikhonov, weights
        grid = search.grid, search.theta, search.neighbours, search.cell
        stop = self.iterations, self.tolerance
        if self.starts == 1:
            evaluations = local_fits(*what, stop, u, loss, residuals)
        elif folds == 1:
            evaluations = global_fit(*what, grid, self.starts, stop, u, loss, residuals)
        else:
            search.reserve(n)
            evaluations = global_fits(*what, grid, search.memo, self.starts, stop, u, loss, residuals)
        _, _, centre, scale = search.model
        return Fit(centre + scale * u, loss, residuals, evaluations, problem.known)

    def _search(self, model: ForwardModel) -> _Search | None:
        """The coarse grid of a compiled model, kept from call to call; None for another model."""
        known = self._searches.get(id(model))
        if known is None or known[0] is not model:
            self._searches.clear()
            known = self._searches[id(model)] = (model, self._new_search(model))
        return known[1]

    def _new_search(self, model: ForwardModel) -> _Search | None:
        parameters = model.parameters
        if not isinstance(model, Compiled):
            return None
        grid = box_grid(self.grid, len(parameters))
        theta = np.ascontiguousarray(parameters.centre + parameters.half_width * grid)
        what = model.kernel, model.constants, parameters.centre, parameters.half_width
        neighbours = axis_neighbours(self.grid, len(parameters))
        return _Search(what, grid, theta, neighbours, 2.0 / self.grid, _memo(32, len(grid)))
