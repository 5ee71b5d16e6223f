"""The fit problem: which parameters explain the samples, and how well (Eq. 3-7).

Fold 0 uses all n samples, fold i + 1 leaves out sample i (Eq. 5). Each fold minimises

    L_k(theta) = (1 / n_k) sum over its samples of r_j^2  +  tau |(theta - theta0) / s|^2

The weak Tikhonov term makes the minimiser exist and be unique where samples are few; the reported
errors leave it out. A model's prediction at theta for all samples gives the loss of every fold, for
each is a weighted mean of the same squared residuals.

| symbol | meaning | shape | unit |
|---|---|---|---|
| theta | candidates | (m, p) | each its own |
| theta0, s | centre and half-width of the bounds | (p,) | each its own |
| r | residuals, prediction - value | (m, n) | field unit |
| tau | Tikhonov weight | | field unit^2 |
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.domain import Grid
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples


class ForwardModel(Protocol):
    """What predicts the field from parameters."""

    @property
    def parameters(self) -> Parameters: ...

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """theta (m, p), positions (n, 2), times (n,) -> (m, n); raises SolveFailed."""
        ...

    def field(self, theta: NDArray, time: float, grid: Grid) -> NDArray[np.float64]:
        """theta (p,) -> (nx, ny)."""
        ...


@runtime_checkable
class Differentiable(Protocol):
    """A forward model that knows its derivatives."""

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """theta (m, p), positions (n, 2), times (n,) -> (m, n, p)."""
        ...


@runtime_checkable
class Compiled(Protocol):
    """A forward model that hands over a compiled MODEL function (see fieldrl.core.compiled)."""

    @property
    def kernel(self) -> int: ...

    @property
    def constants(self) -> NDArray[np.float64]: ...


class Optimisation(NamedTuple):
    """The course of one fit.

    Args:
        theta: what was solved, in order, (k, p).
        loss: the loss of fold 0 there, NaN where the solve failed, (k,) [field unit^2].
    """

    theta: NDArray[np.float64]
    loss: NDArray[np.float64]

    @property
    def best(self) -> NDArray[np.float64]:
        """Least loss so far, (k,)."""
        return np.minimum.accumulate(np.where(np.isnan(self.loss), np.inf, self.loss))


@dataclass(frozen=True)
class Fit:
    """The minimisers of every fold.

    Args:
        theta: (folds, p).
        loss: penalised loss of each fold at its minimiser, (folds,) [field unit^2].
        residuals: prediction - value of all samples at each fold's minimiser, (folds, n) [field unit]. These
            and the loss are of a solve there, or (``composite``) of a surrogate that knows them well enough.
        evaluations: forward evaluations of the whole sample set that were used.
        known: parameters whose solves a later fit may start from, (k, p).
        course: how the minimum was found, where the estimator says.
        gap: how far the loss of each fold is expected to lie above its minimum; NaN or infinite where the
            estimator cannot tell, (folds,) [field unit^2].
        converged: whether that is within the estimator's tolerance, (folds,).
    """

    theta: NDArray[np.float64]
    loss: NDArray[np.float64]
    residuals: NDArray[np.float64]
    evaluations: int
    known: NDArray[np.float64]
    course: Optimisation | None = None
    gap: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    converged: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))

    @property
    def share_converged(self) -> float:
        """Share of the folds that are converged; NaN where the estimator does not say."""
        return float(self.converged.mean()) if self.converged.size else float("nan")


class Errors(NamedTuple):
    """Fitting, cross-validation and total error, Eq. (4), (6), (7) [field unit^2]; NaN: not computed."""

    e_f: float
    e_cv: float
    e_total: float


@dataclass(frozen=True)
class FitProblem:
    """Samples to be explained by a model.

    Args:
        model: the forward model.
        samples: n samples.
        tikhonov: tau >= 0 [field unit^2].
        leave_one_out: with the n folds of Eq. (5), or fold 0 alone.
        known: parameters already solved, (k, p).
    """

    model: ForwardModel
    samples: Samples
    tikhonov: float = 1e-3
    leave_one_out: bool = True
    known: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def folds(self) -> int:
        """n + 1, or 1."""
        return 1 + self.leave_one_out * len(self.samples)

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weight of each sample in each fold, (folds, n); a fold without samples has zeros."""
        return fold_weights(len(self.samples), self.leave_one_out)

    def penalty(self, theta: NDArray) -> NDArray[np.float64]:
        """The Tikhonov term at theta (m, p): (m,) [field unit^2]."""
        u = (theta - self.model.parameters.centre) / self.model.parameters.half_width
        return self.tikhonov * np.sum(u**2, axis=-1)

    def residuals(self, theta: NDArray) -> NDArray[np.float64]:
        """Prediction - value at theta (m, p): (m, n) [field unit]; raises SolveFailed."""
        samples = self.samples
        return self.model.predict(theta, samples.positions, samples.times) - samples.values

    def losses(self, residuals: NDArray, theta: NDArray) -> NDArray[np.float64]:
        """Loss of every fold, from one prediction for each candidate.

        Args:
            residuals: at all samples, (m, n) [field unit].
            theta: the candidates, (m, p).

        Returns:
            (m, folds) [field unit^2].
        """
        return residuals**2 @ self.weights.T + self.penalty(theta)[:, None]


@lru_cache(maxsize=512)
def fold_weights(n: int, leave_one_out: bool) -> NDArray[np.float64]:
    """1 / n_k for the samples of fold k and 0 for the others, (n + 1 or 1, n), read-only."""
    mask = np.ones((1 + leave_one_out * n, n))
    if leave_one_out:
        mask[np.arange(1, n + 1), np.arange(n)] = 0.0
    weights = mask / np.maximum(mask.sum(axis=1, keepdims=True), 1.0)
    weights.flags.writeable = False
    return weights


def errors(fit: Fit) -> Errors:
    """e_f (Eq. 4), e_cv (Eq. 6) and e_total (Eq. 7) of a fit; of fold 0 alone, e_f."""
    folds, n = fit.residuals.shape
    if n == 0:
        raise ValueError("errors need at least one sample")
    full = fit.residuals[0]
    e_f = float(full @ full) / n
    if folds == 1:
        return Errors(e_f, math.nan, math.nan)
    left_out = fit.residuals[1:].ravel()[:: n + 1]
    e_cv = float(left_out @ left_out) / n
    return Errors(e_f, e_cv, e_f + e_cv)
