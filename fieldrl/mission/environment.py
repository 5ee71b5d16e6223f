"""The Gymnasium environment: a vehicle samples a drifting field, the estimator explains the samples.

| symbol | meaning | shape | unit |
|---|---|---|---|
| observation | measured x, y, heading; time | (4,) | length, length, rad, time |
| action | row of Eq. (12) | scalar | |
| state | true x, y, heading | (3,) | length, length, rad |
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

from fieldrl.core.checks import FieldrlError
from fieldrl.core.domain import Domain, Grid
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import Errors, Fit, FitProblem, ForwardModel, errors
from fieldrl.mission.reward import Outcome
from fieldrl.vehicle.unicycle import Flow, Unicycle


class Truth(ForwardModel, Protocol):
    """The forward model that generates the true field."""

    @property
    def grid(self) -> Grid:
        """Where its field is recorded."""
        ...


class Water(ForwardModel, Protocol):
    """A forward model, and the world that the vehicle moves in."""

    @property
    def domain(self) -> Domain: ...

    @property
    def flow(self) -> Flow: ...

    @property
    def horizon(self) -> float:
        """The last time that it can predict [time]."""
        ...

    def truth(self) -> Truth: ...


class Estimator(Protocol):
    """Finds the parameters that explain samples."""

    @property
    def tikhonov(self) -> float: ...

    def fit(self, problem: FitProblem) -> Fit: ...


class Reward(Protocol):
    """What a sample is worth."""

    def __call__(self, outcome: Outcome) -> float: ...


class FieldSampling(gymnasium.Env[NDArray[np.float64], np.int64]):
    """One sample a step until the budget is spent; the reward follows from the estimator's errors.

    ``info`` carries theta (p,), e_f, e_cv, e_total, position (2,), heading, time, value and evaluations.
    A seeded ``reset`` forgets what the estimator has solved; an unseeded one keeps it.

    Args:
        water: the model, its domain and its flow.
        vehicle: kinematics and sensor.
        estimator: what fits the parameters.
        reward: what a sample is worth.
        steps: samples of an episode.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - Gymnasium's own declaration

    def __init__(
        self, water: Water, vehicle: Unicycle, estimator: Estimator, reward: Reward, steps: int
    ) -> None:
        self.water, self.vehicle, self.estimator, self.reward = water, vehicle, estimator, reward
        self.steps = steps
        self.truth = water.truth()
        self.theta = np.array(water.parameters.true)
        (x0, y0), (x1, y1) = water.domain.lower, water.domain.upper
        low_heading, high_heading = vehicle.heading_bounds
        self.low = np.array([x0, y0, low_heading, 0.0])
        self.high = np.array([x1, y1, high_heading, steps * vehicle.time_step])
        self.observation_space = gymnasium.spaces.Box(self.low, self.high, dtype=np.float64)
        self.action_space = gymnasium.spaces.Discrete(len(vehicle.actions))
        self.known = np.empty((0, len(water.parameters)))
        self._begin()

    @property
    def parameters(self) -> Parameters:
        """The unknowns."""
        return self.water.parameters

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Back to the start, with no samples."""
        super().reset(seed=seed)
        if seed is not None:
            self.known = self.known[:0]
        self._begin()
        return self._observe(), {}

    def step(self, action: np.int64 | int) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Move, sample, fit; raises FieldrlError after the last sample or for an unknown action."""
        if len(self.samples) >= self.steps:
            raise FieldrlError("the sample budget is spent: call reset()")
        if not 0 <= action < len(self.vehicle.actions):
            raise FieldrlError(f"action={action}: must be in 0 .. {len(self.vehicle.actions) - 1}")
        self._move(int(action))
        observation = self._observe()
        value = self._sample(observation)
        fit, found = self._fit()
        reward = self._reward(fit, found)
        terminated = len(self.samples) == self.steps
        return observation, reward, terminated, False, self._info(fit, found, value)

    def _begin(self) -> None:
        self.state, self.time = self.vehicle.initial(), 0.0
        self.samples, self.previous = Samples.none(), float("nan")

    def _observe(self) -> NDArray[np.float64]:
        observation = np.empty(4)
        observation[:3] = self.vehicle.sensor.observe(self.state, self.np_random)
        observation[3] = self.time
        if self.vehicle.heading_limits is None:
            observation[2] = math.remainder(observation[2], 2 * math.pi)
        return np.minimum(np.maximum(observation, self.low), self.high)

    def _move(self, action: int) -> None:
        self.state = self.vehicle.step(
            self.state, action, self.time, self.water.flow, self.theta, self.water.domain
        )
        self.time = (len(self.samples) + 1) * self.vehicle.time_step

    def _sample(self, observation: NDArray[np.float64]) -> float:
        """Probe the true field at the true position; keep the sample where the vehicle believes to be."""
        at = np.array([self.time])
        field = self.truth.predict(self.theta[None], self.state[None, :2], at)[0, 0]
        value = self.vehicle.sensor.measure(field, self.np_random)
        self.samples = self.samples.append(observation[:2], self.time, value)
        return value

    def _fit(self) -> tuple[Fit, Errors]:
        self.problem = FitProblem(self.water, self.samples, self.estimator.tikhonov, True, self.known)
        fit = self.estimator.fit(self.problem)
        self.known = fit.known
        return fit, errors(fit)

    def _reward(self, fit: Fit, found: Errors) -> float:
        outcome = Outcome(self.steps, found.e_total, self.previous, self.problem, fit.theta[0])
        self.previous = found.e_total
        return float(self.reward(outcome))

    def _info(self, fit: Fit, found: Errors, value: float) -> dict[str, Any]:
        return {
            "theta": fit.theta[0],
            "e_f": found.e_f,
            "e_cv": found.e_cv,
            "e_total": found.e_total,
            "position": self.state[:2],
            "heading": self.state[2],
            "time": self.time,
            "value": value,
            "evaluations": fit.evaluations,
            "course": fit.course,
        }
