"""Fit problems whose answers are known, and one that is realistic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection


@dataclass(frozen=True)
class Line:
    """y = a x + b t (or a^2 x + b t): linear in the unknowns, or with two solutions for a."""

    squared: bool = False
    reach: float = 10.0

    @property
    def parameters(self) -> Parameters:
        return Parameters(("a", "b"), ("1", "1"), (-self.reach,) * 2, (self.reach,) * 2)

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        a = theta[:, :1] ** 2 if self.squared else theta[:, :1]
        return a * positions[:, 0] + theta[:, 1:] * times

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        slope = 2 * theta[:, :1] if self.squared else np.ones((len(theta), 1))
        return np.stack([slope * positions[:, 0], np.broadcast_to(times, (len(theta), len(times)))], axis=-1)


@dataclass(frozen=True)
class Kinked:
    """y = a below 0, a / 5 above it: less is told of a that is greater."""

    @property
    def parameters(self) -> Parameters:
        return Parameters(("a",), ("1",), (-10.0,), (10.0,))

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        return np.repeat(np.where(theta < 0, theta, theta / 5), len(times), axis=1)

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        return np.repeat(np.where(theta < 0, 1.0, 0.2), len(times), axis=1)[..., None]


class Opaque:
    """A model without its derivatives, which counts its solves."""

    def __init__(self, model) -> None:
        self.model, self.parameters, self.solved = model, model.parameters, set()

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        self.solved.update(one.tobytes() for one in theta)
        return self.model.predict(theta, positions, times)


def line(n: int = 12, seed: int = 0, noise: float = 1.0, true=(2.0, -1.0), **kind) -> FitProblem:
    """Samples of a line with normal noise."""
    rng, model = np.random.default_rng(seed), Line(**kind)
    positions, times = rng.uniform(-1, 1, (n, 2)), rng.uniform(0, 2, n)
    values = model.predict(np.array([true]), positions, times)[0] + noise * rng.standard_normal(n)
    return FitProblem(model, Samples.of(positions, times, values), 0.0, False)


def plume(n: int = 20, seed: int = 0, noise: float = 1.0, true=(5.0, 5.0)) -> FitProblem:
    """Samples about a drifting feature, with normal noise."""
    rng, model, true = np.random.default_rng(seed), Advection(), np.array(true)
    times = np.arange(1.0, n + 1)
    positions = 50.0 + times[:, None] * true + rng.uniform(-40, 40, (n, 2))
    values = model.predict(true[None], positions, times)[0] + noise * rng.standard_normal(n)
    return FitProblem(model, Samples.of(positions, times, values), 0.0, False)


def nothing_seen(n: int = 6, seed: int = 0) -> FitProblem:
    """Samples so far from the feature that only noise is seen."""
    rng = np.random.default_rng(seed)
    samples = Samples.of(
        np.full((n, 2), 1e4) + rng.uniform(0, 1, (n, 2)), np.arange(1.0, n + 1), rng.standard_normal(n)
    )
    return FitProblem(Advection(), samples, 0.0, False)
