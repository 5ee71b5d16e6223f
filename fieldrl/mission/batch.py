"""The steps of many missions as one compiled batch: the numbers of ``FieldSampling``, without its Python.

B missions of one ``Mission`` differ in truths, noise and actions. Their state is arrays with B in front:

| symbol | meaning | shape | unit |
|---|---|---|---|
| state, own | true x, y, heading; measured ones and the time | (B, 3), (B, 4) | length, length, rad, time |
| count | samples so far | (B,) | |
| samples | positions, times, values | (B, N, 2), (B, N), (B, N) | length, time, field unit |
| estimate, previous | of the last fit: theta and total error | (B, p), (B,) | each its own, field unit^2 |
| theta, drift | the truth: unknowns, flow parameters | (B, p), (B, k) | each its own |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.compiled import predict_many
from fieldrl.core.samples import Samples
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.mission.environment import FieldSampling, flow_parameters
from fieldrl.observation.knowledge import KnownMany
from fieldrl.pde.advection import Advection
from fieldrl.pde.tracer import carried_many
from fieldrl.reward.outcome import Outcomes
from fieldrl.scenario.drawn import Drawn
from fieldrl.scenario.fixed import Fixed
from fieldrl.vehicle.sensor import Sensor
from fieldrl.vehicle.unicycle import Unicycle

Told = dict[str, NDArray[Any]]


def serves(environment: FieldSampling) -> bool:
    """Whether missions like this one can be stepped as a batch; see ``FieldSamplingVector``."""
    parts = environment.water, environment.truth, environment.vehicle, environment.estimator
    own = *parts, environment.vehicle.sensor, environment.scenario
    kinds = (Advection,), (Advection,), (Unicycle,), (LeastSquares,), (Sensor,), (Fixed, Drawn)
    built_in = all(type(part) in kind for part, kind in zip(own, kinds, strict=True))
    estimator: Any = environment.estimator
    several = built_in and estimator.starts > 1
    many = hasattr(environment.reward, "many") and hasattr(environment.observation, "see_many")
    return several and many and environment.sure is None


class Batch:
    """B missions, which ``load`` takes from their environments and ``store`` gives back.

    Args:
        environments: of one ``Mission``, each with its own generator.
    """

    def __init__(self, environments: Sequence[FieldSampling]) -> None:
        first: Any = environments[0]
        self.first = first
        self.vehicle, self.steps, self.parameters = first.vehicle, first.steps, first.parameters
        count, steps, p = len(environments), first.steps, len(first.parameters)
        self.state, self.own = np.empty((count, 3)), np.empty((count, 4))
        self.seen = np.empty((count, first.low.size))
        self.count = np.zeros(count, dtype=np.int64)
        self.samples = np.zeros((count, steps, 2)), np.zeros((count, steps)), np.zeros((count, steps))
        self.estimate, self.theta = np.empty((2, count, p))
        self.previous, self.drift = np.empty(count), np.empty((count, first.drift.size))
        self.place = np.empty((count, 2))
        self.constants = np.empty((count, first.water.constants.size))
        self.true_constants = np.empty((count, first.truth.constants.size))
        self.draws: list[Any] = [None] * count
        self.fits = first.estimator.many(first.water, count, steps)

    def load(self, i: int, environment: Any) -> None:
        """Take mission ``i`` as it is after a reset."""
        self.state[i], self.own[i], self.count[i] = environment.state, environment.own, 0
        self.estimate[i], self.previous[i] = environment.estimate, environment.previous
        self.theta[i], self.drift[i] = environment.theta, environment.drift
        self.place[i] = environment.place
        self.constants[i] = environment.water.constants
        self.true_constants[i] = environment.truth.constants
        self.draws[i] = environment.np_random.standard_normal
        self.fits.forget(i)

    def store(self, i: int, environment: FieldSampling) -> None:
        """Bring an environment to where mission ``i`` is."""
        if self.draws[i] is None:  # never reset
            return
        n = int(self.count[i])
        positions, times, values = (part[i, :n].copy() for part in self.samples)
        samples = Samples(positions, times, values)
        environment.resume(self.state[i].copy(), samples, self.estimate[i].copy(), float(self.previous[i]))
        environment.own = self.own[i].copy()

    @property
    def over(self) -> NDArray[np.bool_]:
        """Which missions have taken all their samples, (B,)."""
        return self.count == self.steps

    def step(self, which: NDArray[np.int64], actions: NDArray[np.int64]) -> tuple[NDArray[np.float64], Told]:
        """Move, sample, fit; ``own``, ``seen`` and the state follow.

        Args:
            which: missions, (b,).
            actions: one for each of them, (b,).

        Returns:
            Rewards (B,) and what ``info`` carries, each with B in front; 0 for missions that are not stepped.
        """
        told = self._nothing()
        rewards = np.zeros(len(self.count))
        measured = self._sample(which, actions, told)
        self._observe(which, measured)
        counts = self.count[which]
        for n in np.unique(counts):
            self._conclude(which[counts == n], int(n), rewards, told)
        return rewards, told

    def _nothing(self) -> Told:
        b, p = self.estimate.shape
        names = "e_f", "e_cv", "e_total", "heading", "time", "value", "converged"
        told: Told = {name: np.zeros(b) for name in names}
        told |= {
            "position": np.zeros((b, 2)),
            "measured_position": np.zeros((b, 2)),
            "theta": np.zeros((b, p)),
        }
        return told | {"evaluations": np.zeros(b, dtype=np.int64), "course": np.full(b, None, dtype=object)}

    def _sample(self, which: NDArray, actions: NDArray, told: Told) -> NDArray[np.float64]:
        """Move, and probe the true field; returns the measured states (b, 3)."""
        times = self.count[which] * self.vehicle.time_step
        parts = self.first.truth.flow, self.drift[which], self.first.water.domain
        state = self.vehicle.step_many(self.state[which], actions, times, *parts)
        self.state[which] = state
        places = which, self.count[which]
        self.count[which] += 1
        times = self.count[which] * self.vehicle.time_step
        measured, noise = self._noise(which, state)
        kernel = self.first.truth.kernel
        at = state[:, None, :2].copy(), times[:, None]
        field = predict_many(kernel, self.true_constants[which], self.theta[which], *at)[0][:, 0]
        values = field + noise
        for kept, new in zip(self.samples, (measured[:, :2], times, values), strict=True):
            kept[places] = new
        told["position"][which], told["heading"][which] = state[:, :2], state[:, 2]
        told["measured_position"][which], told["time"][which] = measured[:, :2], times
        told["value"][which] = values
        return measured

    def _noise(
        self, which: NDArray, state: NDArray
    ) -> tuple[NDArray[np.float64], NDArray[np.float64] | float]:
        """Measured states (b, 3) and the noise of the samples (b,), drawn as single missions draw them."""
        sensor: Any = self.vehicle.sensor
        vague, loud = any(sensor.covariance), bool(sensor.noise)
        size = 3 * vague + loud
        if not size:
            return state, 0.0
        draws = [self.draws[i] for i in which.tolist()]
        drawn = np.array([draw(size) if size > 1 else draw() for draw in draws]).reshape(-1, size)
        measured = state + np.sqrt(sensor.covariance) * drawn[:, :3] if vague else state
        return measured, sensor.noise * drawn[:, -1] if loud else 0.0

    def _observe(self, which: NDArray, measured: NDArray[np.float64]) -> None:
        """What the vehicles measure of themselves, within the bounds."""
        own = np.empty((len(which), 4))
        own[:, :3], own[:, 3] = measured, self.count[which] * self.vehicle.time_step
        if self.vehicle.heading_limits is None:
            own[:, 2] = [math.remainder(heading, 2 * math.pi) for heading in own[:, 2].tolist()]
        self.own[which] = self.first.within_walls(own)

    def _conclude(self, which: NDArray, n: int, rewards: NDArray, told: Told) -> None:
        """Fit missions that have n samples; their errors, rewards and observations."""
        every_fold = self.first.every_fold or n == self.steps
        found = self.fits.fit(self.constants, self.samples, which, n, every_fold)
        theta, residuals, converged, evaluations = found
        e_f, e_cv = _errors(residuals)
        self.estimate[which] = theta[:, 0]
        slopes = self._slopes(which, n)
        outcomes = Outcomes(self.steps, n, e_f + e_cv, self.previous[which], slopes)
        rewards[which] = self.first.reward.many(outcomes)
        self.previous[which] = outcomes.e_total
        self.seen[which] = self._seen(which, n, slopes)
        told["e_f"][which], told["e_cv"][which], told["e_total"][which] = e_f, e_cv, outcomes.e_total
        told["theta"][which], told["evaluations"][which] = theta[:, 0], evaluations
        told["converged"][which] = converged.mean(axis=1)

    def _slopes(self, which: NDArray, n: int) -> NDArray[np.float64]:
        """Derivatives of all predictions by the unknowns in half-widths, (b, n, p) [field unit]."""
        kernel, where = self.first.water.kernel, (part[which, :n] for part in self.samples[:2])
        jacobian = predict_many(kernel, self.constants[which], self.estimate[which], *where)[1]
        return jacobian * self.parameters.half_width

    def _seen(self, which: NDArray, n: int, slopes: NDArray) -> NDArray[np.float64]:
        """The observations of missions that have n samples, (b, k)."""
        theta, observation, water = self.estimate[which], self.first.observation, self.first.water
        plumes = self.place[which]
        if getattr(observation, "needs_feature", False):
            flows = np.array([flow_parameters(water, each) for each in theta])
            plumes = carried_many(water.flow, flows, plumes, n * self.vehicle.time_step)
        newest, noise = self.samples[2][which, n - 1], self.vehicle.sensor.noise
        known = KnownMany(self.parameters, newest, slopes, theta, plumes, water.initial.scale, noise)
        seen = observation.see_many(self.own[which], known)
        return np.minimum(np.maximum(seen, self.first.low), self.first.high)


def _errors(residuals: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """e_f and e_cv (b,) from the residuals of the folds (b, folds, n), as ``problem.errors`` has them.

    A fold's left-out residual is taken from where it lies in memory: the order of summation depends on it.
    """
    b, folds, n = residuals.shape
    full, left_out = residuals[:, 0], residuals[:, 1:].reshape(b, -1)[:, :: n + 1]
    e_cv = np.vecdot(left_out, left_out) / n if folds > 1 else np.full(b, math.nan)
    return np.vecdot(full, full) / n, e_cv
