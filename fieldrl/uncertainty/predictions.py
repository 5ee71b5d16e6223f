"""What the samples would be for any unknowns, with derivatives, cheap enough to ask for thousands of times.

A compiled or differentiable model answers itself. For a dear one a surrogate of its predictions does, made of
the solves that the fit already paid for.

| symbol | meaning | shape | unit |
|---|---|---|---|
| u | scaled unknowns (theta - theta0) / s | (m, p) | half-width of the bounds |
| y | predictions of all samples | (m, n) | field unit |
| J | their derivatives by u | (m, n, p) | field unit |
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.core.compiled import call_model
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import Compiled, Differentiable, FitProblem, ForwardModel
from fieldrl.estimator.surrogate.acquisition import Solves, neighbours
from fieldrl.estimator.surrogate.predictions import Surrogate, condition, evidence, linearise, predict

_NEAR = 60  # solves that a surrogate is conditioned on


class Predictions(Protocol):
    """Predictions of n samples as a function of u."""

    def linearise(self, u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """y (m, n) and J (m, n, p) at u (m, p)."""
        ...

    def doubt(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Standard deviation of y where it is itself an estimate, (m, n) [field unit]."""
        ...


class OfModel:
    """Predictions of a model with derivatives: exact.

    Args:
        model: compiled or differentiable.
        samples: where and when.
    """

    def __init__(self, model: ForwardModel, samples: Samples) -> None:
        self.model, self.samples = model, samples
        self.compiled = model if isinstance(model, Compiled) else None  # a Protocol takes its time to answer
        self.centre, self.scale = model.parameters.centre, model.parameters.half_width

    def linearise(self, u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """y (m, n) and J (m, n, p) at u (m, p)."""
        model, samples = self.model, self.samples
        theta = np.ascontiguousarray(self.centre + self.scale * u)
        if self.compiled is not None:
            y = np.empty((len(theta), len(samples)))
            slopes = np.empty((*y.shape, theta.shape[1]))
            _call(
                self.compiled.kernel,
                self.compiled.constants,
                theta,
                samples.positions,
                samples.times,
                y,
                slopes,
            )
        elif isinstance(model, Differentiable):
            y = model.predict(theta, samples.positions, samples.times)
            slopes = model.jacobian(theta, samples.positions, samples.times)
        else:
            raise TypeError(f"{type(model).__name__} has no derivatives; a surrogate of it has")
        return y, slopes * self.scale

    def doubt(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """0."""
        return np.zeros((len(u), len(self.samples)))


class OfSurrogate:
    """Predictions of a Gaussian process on the solves of a model without derivatives.

    Args:
        problem: model and samples.
        theta: what was solved, (k, p), at least one.
    """

    def __init__(self, problem: FitProblem, theta: NDArray[np.float64]) -> None:
        parameters = problem.model.parameters
        residuals = problem.residuals(theta)
        whole = np.isfinite(residuals).all(axis=1)
        theta, residuals = theta[whole], residuals[whole]
        u = (theta - parameters.centre) / parameters.half_width
        solves = Solves(u, residuals + problem.samples.values, problem.losses(residuals, theta)[:, :1])
        near = solves.at(neighbours(solves, _NEAR))
        self.surrogate: Surrogate = condition(evidence(near.u, near.outputs, problem.samples.values))

    def linearise(self, u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """y (m, n) and J (m, n, p) at u (m, p)."""
        y = np.empty((len(u), len(self.surrogate.mean)))
        slopes = np.empty((*y.shape, u.shape[1]))
        _linearise_each(self.surrogate, np.ascontiguousarray(u), y, slopes)
        return y, slopes

    def doubt(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """The process's standard deviation, (m, n) [field unit]."""
        return predict(self.surrogate, u)[1]


def predictions(problem: FitProblem, solved: NDArray[np.float64]) -> Predictions:
    """The cheapest exact predictions of a problem's samples, or a surrogate.

    Args:
        problem: model and samples.
        solved: parameters that were solved before, (k, p), for a model without derivatives.
    """
    if isinstance(problem.model, Compiled | Differentiable):
        return OfModel(problem.model, problem.samples)
    return OfSurrogate(problem, solved)


@njit(cache=True, error_model="numpy")
def _call(kernel, constants, theta, positions, times, prediction, jacobian):
    call_model(
        kernel, theta.ctypes, theta.shape[0], positions.ctypes, times.ctypes, times.size, constants.ctypes,
        prediction.ctypes, jacobian.ctypes,
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _linearise_each(surrogate, u, mean, slopes):
    for i in range(len(u)):
        linearise(surrogate, u[i], mean[i], slopes[i])
