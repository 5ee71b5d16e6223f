"""Residuals of samples whose loss is not the plain square: a robust loss, unlike noise, detection limits.

    s_i(theta) = sigma root((prediction_i - value_i) / (sigma w_i)),   sum of s_i^2 is what is minimised

A value that is a detection limit counts only where the prediction lies above it. So every estimator fits
every loss, and the intervals follow from the same deviance.

| symbol | meaning | shape | unit |
|---|---|---|---|
| sigma | scale of the noise | | field unit |
| w | stated standard deviations, relative to their root mean square; else 1 | (n,) | |
| z | standardised residuals | (m, n) | |
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.domain import Grid
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import Compiled, Differentiable, Fit, FitProblem, ForwardModel
from fieldrl.mission.environment import Estimator

_NORMAL = 1.4826  # standard deviation of normal noise by its median absolute value
_ROUNDS, _SETTLED = 10, 0.02  # of the search for the scale
_FAR = 4.0  # standard deviations: an outlier


class Loss(Protocol):
    """See fieldrl.loss."""

    @property
    def robust(self) -> bool: ...

    def root(self, z: NDArray[np.float64]) -> NDArray[np.float64]: ...

    def slope(self, z: NDArray[np.float64]) -> NDArray[np.float64]: ...

    def inverse(self, s: NDArray[np.float64]) -> NDArray[np.float64]: ...


@dataclass(frozen=True, eq=False)
class RobustResiduals:
    """A forward model of the roots of losses, at the samples that it was made for.

    Args:
        model: predicts the values.
        samples: n samples.
        loss: of a standardised residual.
        scale: sigma.
        paid: predictions by theta, kept from scale to scale.
    """

    model: ForwardModel
    samples: Samples
    loss: Loss
    scale: float = 1.0
    paid: dict[bytes, NDArray[np.float64]] = field(default_factory=dict)

    @property
    def parameters(self) -> Parameters:
        """The model's."""
        return self.model.parameters

    @property
    def weights(self) -> NDArray[np.float64]:
        """w, (n,)."""
        std = self.samples.std
        return np.ones(len(self.samples)) if std is None else std / np.sqrt(np.mean(std**2))

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """s at theta (m, p): (m, n) [field unit]; positions and times are those of the samples."""
        return self.scale * self.loss.root(self.standardised(theta, positions, times))

    def standardised(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """z at theta (m, p), 0 where a prediction lies below a detection limit, (m, n)."""
        keys = [row.tobytes() for row in np.asarray(theta, dtype=float)]
        new = [i for i, key in enumerate(keys) if key not in self.paid]
        if new:
            found = self.model.predict(np.asarray(theta)[new], positions, times)
            self.paid.update((keys[i], row) for i, row in zip(new, found, strict=True))
        prediction = np.array([self.paid[key] for key in keys])
        z = (prediction - self.samples.values) / (self.scale * self.weights)
        below = self.samples.censored
        return z if below is None else np.where(below & (z < 0.0), 0.0, z)

    def field(self, theta: NDArray, time: float, grid: Grid) -> NDArray[np.float64]:
        """The model's."""
        return self.model.field(theta, time, grid)

    def fit(self, estimator: Estimator, folds: bool, known: NDArray[np.float64]) -> Fit:
        """The fit of roots, its residuals still s."""
        return estimator.fit(self.problem(estimator, folds, known))

    def problem(self, estimator: Estimator, folds: bool, known: NDArray[np.float64]) -> FitProblem:
        """Least squares of the roots."""
        roots = Samples.of(self.samples.positions, self.samples.times, np.zeros(len(self.samples)))
        return FitProblem(self, roots, estimator.tikhonov, folds, known)

    def plain(self, fit: Fit) -> Fit:
        """A fit with residuals in place of roots."""
        return replace(
            fit, residuals=self.scale * self.weights * self.loss.inverse(fit.residuals / self.scale)
        )

    def outliers(self, fit: Fit) -> NDArray[np.int64]:
        """Which samples lie more than four standard deviations off, by a plain fit of all."""
        return np.flatnonzero(np.abs(fit.residuals[0]) > _FAR * self.scale * self.weights)


@dataclass(frozen=True, eq=False)
class DifferentiableResiduals(RobustResiduals):
    """The same of a model that knows its derivatives."""

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """ds/dtheta at theta (m, p): (m, n, p)."""
        model = self.model
        if not isinstance(model, Differentiable):
            raise TypeError(f"{type(model).__name__} has no derivatives")
        z = self.standardised(theta, positions, times)
        slope = np.where((z == 0.0) & (self.samples.censored is not None), 0.0, self.loss.slope(z))
        return (slope / self.weights)[:, :, None] * model.jacobian(theta, positions, times)


def plain_squares(samples: Samples, loss: Loss) -> bool:
    """Whether ordinary least squares is all there is to it: no robust loss, no limit, one noise for all."""
    alike = samples.std is None or bool(np.all(samples.std == samples.std[0]))
    return alike and samples.censored is None and not loss.robust


def robust_residuals(
    samples: Samples, model: ForwardModel, estimator: Estimator, loss: Loss
) -> tuple[RobustResiduals, NDArray[np.float64]]:
    """The problem with its scale, as stated, else by the median of the residuals of the fit itself.

    Returns:
        The problem, and what a fit of it starts from, (k, p): the minimum of a robust loss is narrow.
    """
    kind = DifferentiableResiduals if isinstance(model, Differentiable) else RobustResiduals
    made = kind(model, samples, loss)
    known = np.empty((0, len(made.parameters)))
    if isinstance(model, Compiled):  # its global minimum is cheap
        known = estimator.fit(FitProblem(model, samples, estimator.tikhonov, False, known)).theta[:1]
    if samples.std is not None:
        return replace(made, scale=float(np.sqrt(np.mean(samples.std**2)))), known
    if not loss.robust:
        return made, known
    return _scaled(made, estimator, known)


def _scaled(
    made: RobustResiduals, estimator: Estimator, known: NDArray[np.float64]
) -> tuple[RobustResiduals, NDArray[np.float64]]:
    """From the spread of the values down to that of the residuals, so that no outlier leads astray."""
    values = made.samples.values
    count, unknowns = len(values), len(made.parameters)
    least = 1e-9 * max(float(np.abs(values).max()), 1e-30)
    free = np.sqrt(count / max(count - unknowns, 1))
    scale = _NORMAL * float(np.median(np.abs(values - np.median(values)))) or float(np.std(values))
    made = replace(made, scale=max(scale, least))
    for _ in range(_ROUNDS):
        fit = made.fit(estimator, False, known)
        known = fit.known if len(fit.known) > len(known) else fit.theta[:1]
        size = _NORMAL * free * float(np.median(np.abs(made.plain(fit).residuals[0])))
        before, made = made.scale, replace(made, scale=max(size, least))
        if abs(made.scale - before) <= _SETTLED * before:
            break
    return made, known
