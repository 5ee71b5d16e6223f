"""Nonlinear least squares for every fold: the estimator for cheap models.

A compiled model (see ``problem.Compiled``) is fitted by the compiled Levenberg-Marquardt; any other by
SciPy's bounded least squares from several starts.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks, kinds
from fieldrl.core.cost import DOUBLE, Cost, Extent, solve_seconds
from fieldrl.core.kinds import component
from fieldrl.estimator.descent.coarse_search import axis_neighbours, box_grid
from fieldrl.estimator.descent.global_fit import global_fit, global_fits, local_fits, many_fits
from fieldrl.estimator.problem import Compiled, Fit, FitProblem, ForwardModel, fold_weights


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


@dataclass
class ManyFits:
    """Compiled fits of many problems that know nothing of each other; see ``LeastSquares.many``.

    Args:
        search: the coarse grid, which all have in common.
        memos: labels, squared residuals, running sums and maxima as in ``_Search``, each problem's own.
        starts: of ``LeastSquares``.
        tikhonov: of ``LeastSquares``.
        stop: most evaluations of a descent, and the scaled step that is its last.
    """

    search: _Search
    memos: tuple[NDArray, ...]
    starts: int
    tikhonov: float
    stop: tuple[int, float]

    def forget(self, i: int) -> None:
        """Problem ``i`` begins anew, perhaps with another model."""
        self.memos[0][i] = np.nan

    def fit(
        self,
        constants: NDArray,
        samples: tuple[NDArray, NDArray, NDArray],
        which: NDArray,
        n: int,
        leave_one_out: bool,
    ) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """The fits of some problems, the same as ``LeastSquares.fit`` gives one by one.

        Args:
            constants: of the model in each problem, (B, k).
            samples: positions (B, capacity, 2), times (B, capacity), values (B, capacity).
            which: the problems that are fitted, (b,).
            n: how many samples they have.
            leave_one_out: with the n folds that leave a sample out, or fold 0 alone.

        Returns:
            Parameters (b, folds, p), residuals (b, folds, n), which converged (b, folds), evaluations (b,).
        """
        search, weights, b = self.search, fold_weights(n, leave_one_out), len(which)
        kernel, _, centre, scale = search.model
        folds = len(weights)
        u, residuals = np.empty((b, folds, len(centre))), np.empty((b, folds, n))
        loss, gap = np.empty((2, b, folds))
        evaluations = np.empty(b, dtype=np.int64)
        grid = search.grid, search.theta, search.neighbours, search.cell
        many_fits(
            kernel, constants, (centre, scale), samples, which, self.tikhonov, weights, grid, self.memos,
            self.starts, self.stop, u, loss, residuals, gap, evaluations,
        )  # fmt: skip
        return centre + scale * u, residuals, np.isfinite(gap), evaluations


_REMEMBERED = 64  # samples at most whose rows on the grid are kept where fold 0 is fitted alone
_MOST_POINTS = 20_000  # of the coarse grid, from three parameters on
_DESCENT, _STEP = 12, 4e-5  # evaluations of a descent, typically; time of a fit's beginning and end [s]


def _memo(capacity: int, size: int) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Labels (capacity, 4), squared residuals, running sums and maxima (capacity, size)."""
    squared, total, largest = np.empty((3, capacity, size))
    return np.full((capacity, 4), np.nan), squared, total, largest


@component
class LeastSquares:
    """Levenberg-Marquardt on all folds.

    Args:
        starts: 1 descends once, from the centre of the bounds, as a local optimiser does; more descend
            from so many of the lowest minima of a coarse grid, to the global minimum.
        grid: points of the coarse grid along each parameter; fewer where more than 20,000 would result.
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

    def cost(self, extent: Extent, model: ForwardModel) -> Cost:
        """The coarse grid's squared residuals, and the descents of every fold; solves, for another model."""
        n, grid = extent.steps, float(self._points(extent.parameters)) ** extent.parameters
        if not kinds.fits(model, Compiled):  # isinstance would ask for its constants
            solves = _DESCENT * (self.starts + n / 2) * extent.samples
            return Cost(seconds=solves * solve_seconds(model, n), by=("starts",))
        several = self.starts > 1
        rows = 3 * max(64, 2 * n) + 4 * extent.parameters + 2
        memory = DOUBLE * (several * grid * rows + 4 * self.starts * (n + 9) + min(n, 512) * n * n)
        one, pooled = solve_seconds(model, 1), extent.samples
        fits = extent.samples * (_STEP + _DESCENT * one * n * n / 3)
        on_grid = several * grid * one * (extent.samples + pooled)
        return Cost(memory, fits + on_grid, by=("starts", "grid"))

    def fit(self, problem: FitProblem) -> Fit:
        """Minimisers of every fold; raises SolveFailed where every solve of a model by differences fails."""
        search = self._search(problem.model)
        if search is None:
            from fieldrl.estimator.descent.multi_start import (
                MultiStart,  # SciPy's optimisers take long to import
            )

            return MultiStart(starts=self.starts, tikhonov=self.tikhonov).fit(problem)
        samples, weights = problem.samples, problem.weights
        folds, n = weights.shape
        u, residuals = np.empty((folds, search.grid.shape[1])), np.empty((folds, n))
        loss, gap = np.empty((2, folds))
        what = search.model, (samples.positions, samples.times, samples.values), self.tikhonov, weights
        grid = search.grid, search.theta, search.neighbours, search.cell
        stop = self.iterations, self.tolerance
        if self.starts == 1:
            evaluations = local_fits(*what, stop, u, loss, residuals, gap)
        elif folds == 1 and n > _REMEMBERED:
            evaluations = global_fit(*what, grid, self.starts, stop, u, loss, residuals, gap)
        else:
            search.reserve(n)
            evaluations = global_fits(*what, grid, search.memo, self.starts, stop, u, loss, residuals, gap)
        _, _, centre, scale = search.model
        theta, reached = centre + scale * u, np.isfinite(gap)
        return Fit(theta, loss, residuals, evaluations, problem.known, gap=gap, converged=reached)

    def many(self, model: ForwardModel, count: int, capacity: int) -> ManyFits:
        """What fits ``count`` problems of at most ``capacity`` samples at a time.

        Args:
            model: a compiled model; those of the problems may differ from it in their constants.
            count: how many problems.
            capacity: most samples of each.

        Raises:
            TypeError: the model is not compiled.
        """
        search = self._new_search(model)
        if search is None:
            raise TypeError(f"{type(model).__name__} is not compiled")
        memos = [np.stack([part] * count) for part in _memo(capacity, len(search.grid))]
        stop = self.iterations, self.tolerance
        return ManyFits(search, tuple(memos), self.starts, self.tikhonov, stop)

    def _points(self, p: int) -> int:
        """Points of the coarse grid along each of p parameters."""
        return self.grid if p < 3 else max(3, min(self.grid, int(_MOST_POINTS ** (1 / p) + 1e-9)))

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
        points = self._points(len(parameters))
        grid = box_grid(points, len(parameters))
        theta = np.ascontiguousarray(parameters.centre + parameters.half_width * grid)
        what = model.kernel, model.constants, parameters.centre, parameters.half_width
        neighbours = axis_neighbours(points, len(parameters))
        return _Search(what, grid, theta, neighbours, 2.0 / points, _memo(32, len(grid)))
