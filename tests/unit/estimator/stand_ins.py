"""Cheap forward models that stand in for dear ones, and fit problems on them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.checks import SolveFailed
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection

TRUE = np.array([0.3, -0.2])


@dataclass
class Waves:
    """A smooth model with several local minima; counts its solves and fails where it is told to."""

    fails: object = None  # theta (p,) -> bool
    solved: list = field(default_factory=list)
    parameters = Parameters(("a", "b"), ("1", "1"), (-1.0, -1.0), (1.0, 1.0), tuple(TRUE))

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        return np.array([self._solve(one, positions, times) for one in theta]).reshape(len(theta), len(times))

    def _solve(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        self.solved.append(theta.tobytes())
        if self.fails is not None and self.fails(theta):
            raise SolveFailed(theta, 1.0, "told to")
        a, b = theta
        phase = positions[:, 0] * a * 4 + positions[:, 1] * b * 4
        return 20 * np.sin(phase) + 10 * times * np.exp(-((a + b * positions[:, 0]) ** 2))

    def field(self, theta, time, grid):
        raise NotImplementedError


@dataclass(frozen=True)
class Passing:
    """A narrow feature that moves with (a, b); where it misses all samples the loss is a plateau."""

    width: float
    parameters = Parameters(("a", "b"), ("1", "1"), (-1.0, -1.0), (1.0, 1.0))

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        away = positions - theta[:, None, :] * times[None, :, None]
        return 80 * np.exp(-0.5 * np.sum((away / self.width) ** 2, axis=2))


def passing(seed: int, width: float, n: int = 12) -> tuple[FitProblem, float]:
    """Samples about the true centre of a feature that passes by, and the loss of the truth."""
    rng, model, times = np.random.default_rng(seed), Passing(width), np.linspace(0.5, 1.0, n)
    true = rng.uniform(-0.9, 0.9, 2)
    positions = true * times[:, None] + rng.uniform(-1.5 * width, 1.5 * width, (n, 2))
    values = model.predict(true[None], positions, times)[0] + rng.standard_normal(n)
    of = FitProblem(model, Samples.of(positions, times, values), leave_one_out=False)
    return of, float(of.losses(of.residuals(true[None]), true[None])[0, 0])


def samples(n: int, seed: int = 0, noise: float = 0.5) -> Samples:
    rng = np.random.default_rng(seed)
    positions, times = rng.uniform(0, 1, (n, 2)), np.arange(1.0, n + 1) / max(n, 1)
    values = Waves().predict(TRUE[None], positions, times)[0] + noise * rng.standard_normal(n)
    return Samples.of(positions, times, values)


def problem(n: int = 8, seed: int = 0, model=None, **settings) -> FitProblem:
    return FitProblem(Waves() if model is None else model, samples(n, seed), **settings)


def advection(n: int = 8, seed: int = 0, **settings) -> FitProblem:
    """The closed form as a black box."""
    model, rng = Advection(), np.random.default_rng(seed)
    positions = 50.0 + 5.0 * np.arange(1.0, n + 1)[:, None] + rng.uniform(-25, 25, (n, 2))
    times = np.arange(1.0, n + 1)
    values = model.predict(np.array([[5.0, 5.0]]), positions, times)[0] + rng.standard_normal(n)
    return FitProblem(model, Samples.of(positions, times, values), **settings)
