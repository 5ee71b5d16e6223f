"""The Gymnasium environment: a vehicle samples a drifting field, the estimator explains the samples.

| symbol | meaning | shape | unit |
|---|---|---|---|
| own state | measured x, y, heading; time | (4,) | length, length, rad, time |
| observation | what the component ``observation`` makes of it | (k,) | |
| action | row of Eq. (12) | scalar | |
| state | true x, y, heading | (3,) | length, length, rad |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.situation import Situation
from fieldrl.core.checks import FieldrlError, one_of
from fieldrl.core.domain import Domain, Grid
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import Errors, Fit, FitProblem, ForwardModel, errors
from fieldrl.mission import rendering
from fieldrl.observation.knowledge import Known, Observation
from fieldrl.observation.paper import Paper
from fieldrl.reward.outcome import Outcome, Reward
from fieldrl.scenario import Scenario
from fieldrl.scenario.fixed import Fixed
from fieldrl.vehicle.unicycle import Flow


class Truth(ForwardModel, Protocol):
    """The forward model that generates the true field, and the flow that carries field and vehicle."""

    @property
    def flow(self) -> Flow: ...

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

    def admissible(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The nearest positions that it can predict at, (n, 2) -> (n, 2) [length]."""
        ...

    def truth(self) -> Truth: ...


class Sensor(Protocol):
    """What the vehicle sees, of its own state (3,) and of the field."""

    @property
    def noise(self) -> float:
        """Standard deviation of a sample's noise [field unit]."""
        ...

    def observe(self, state: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]: ...

    def measure(self, value: float, rng: np.random.Generator) -> float: ...


class Vehicle(Protocol):
    """What moves and samples; see ``fieldrl.vehicle.unicycle.Unicycle``."""

    @property
    def start(self) -> Sequence[float]: ...

    @property
    def sensor(self) -> Sensor: ...

    @property
    def time_step(self) -> float: ...

    @property
    def heading_limits(self) -> Sequence[float] | None: ...

    @property
    def heading_bounds(self) -> tuple[float, float]: ...

    @property
    def actions(self) -> NDArray[np.float64]: ...

    def initial(self) -> NDArray[np.float64]: ...

    def check_start(self, domain: Domain) -> None: ...

    def step(
        self,
        state: NDArray[np.float64],
        action: int,
        time: float,
        flow: Flow,
        theta: NDArray[np.float64],
        domain: Domain,
    ) -> NDArray[np.float64]: ...


class Estimator(Protocol):
    """Finds the parameters that explain samples."""

    @property
    def tikhonov(self) -> float: ...

    def fit(self, problem: FitProblem) -> Fit: ...


def flow_parameters(model: Any, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """The parameters of a model's flow at theta (p,): theta itself, where the model does not tell others."""
    return model.flow_parameters(theta) if hasattr(model, "flow_parameters") else theta


_PAPER, _FIXED = Paper(), Fixed()
_MODES = ("rgb_array", "human")
CROSS_VALIDATION = ("every_step", "as_needed")
"""When the folds that leave a sample out are fitted."""


class FieldSampling(gymnasium.Env[NDArray[np.float64], np.int64]):
    """One sample a step until the budget is spent, or enough is known; the reward follows from the errors.

    ``info`` carries theta (p,), e_f, e_cv, e_total, position and measured_position (2,), heading, time,
    value, evaluations and converged, the share of the fits that did. The observation is kept in its space,
    at the walls; the fit is given the position as it was measured, or the nearest to it that the model can
    predict at.
    With ``cross_validation="as_needed"`` e_cv and e_total are NaN but after an episode's last sample, where
    the reward does not need them. Estimates by least squares stay the same, bit for bit; for Bayesian
    optimisation solves for one fold tell of the others, so that its estimates move within their tolerance.
    A seeded ``reset`` forgets what the estimator has solved; an unseeded one keeps it.

    Args:
        water: the model, its domain and its flow.
        vehicle: kinematics and sensor.
        estimator: what fits the parameters.
        reward: what a sample is worth.
        steps: samples of an episode.
        observation: what the agent sees.
        scenario: what is true in an episode; a ``reset`` draws it from ``chance`` or, where that is None,
            from the environment's own generator.
        sure: whether a fit of a problem's samples tells enough for the episode to end; None: never.
        render_mode: "rgb_array": ``render`` gives a picture (see ``rendering``); "human": each step is shown
            in a window; None: neither.
        cross_validation: when the folds of Eq. (5) are fitted, "every_step" or "as_needed".
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 4}  # noqa: RUF012 - Gymnasium's own

    def __init__(
        self,
        water: Water,
        vehicle: Vehicle,
        estimator: Estimator,
        reward: Reward,
        steps: int,
        observation: Observation = _PAPER,
        scenario: Scenario = _FIXED,
        sure: Callable[[FitProblem, Fit], bool] | None = None,
        render_mode: str | None = None,
        cross_validation: str = CROSS_VALIDATION[0],
    ) -> None:
        self.render_mode = None if render_mode is None else one_of("render_mode", render_mode, _MODES)
        every = one_of("cross_validation", cross_validation, CROSS_VALIDATION) == CROSS_VALIDATION[0]
        self.every_fold = every or getattr(reward, "needs_errors", True)
        self.window: rendering.Window | None = None
        self.vehicle, self.estimator, self.reward, self.steps = vehicle, estimator, reward, steps
        self.observation, self.scenario, self.sure = observation, scenario, sure
        self.chance: np.random.Generator | None = None
        self._configured = water
        self._become(water)
        (x0, y0), (x1, y1) = water.domain.lower, water.domain.upper
        low_heading, high_heading = vehicle.heading_bounds
        self._low = np.array([x0, y0, low_heading, 0.0])
        self._high = np.array([x1, y1, high_heading, steps * vehicle.time_step])
        self.low, self.high = observation.bounds(self._low, self._high, water)
        self.observation_space = gymnasium.spaces.Box(self.low, self.high, dtype=np.float64)
        self.action_space = gymnasium.spaces.Discrete(len(vehicle.actions))
        self.known = np.empty((0, len(water.parameters)))
        self._begin()

    def _become(self, water: Water) -> None:
        """Take another water, with its truth."""
        self.water, self.truth = water, water.truth()
        self.theta = np.array(water.parameters.true)
        self.drift = flow_parameters(self.truth, self.theta)

    @property
    def parameters(self) -> Parameters:
        """The unknowns."""
        return self.water.parameters

    @property
    def place(self) -> NDArray[np.float64]:
        """The centre of this episode's initial feature, (2,); NaN where that has none [length]."""
        return np.array(getattr(getattr(self.water, "initial", None), "centre", (math.nan, math.nan)))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Back to the start, with no samples; in a scenario that varies, with another truth."""
        super().reset(seed=seed)
        if seed is not None or self.scenario.varies:
            self.known = self.known[:0]
        if self.scenario.varies:
            self._become(self.scenario.draw(self._configured, self.chance or self.np_random))
        self._begin()
        seen = self._observed(self._measure())
        self.show()
        return seen, {}

    def step(self, action: np.int64 | int) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Move, sample, fit; raises FieldrlError after the last sample or for an unknown action."""
        if self.over:
            raise FieldrlError("the sample budget is spent, or enough is known: call reset()")
        if not 0 <= action < len(self.vehicle.actions):
            raise FieldrlError(f"action={action}: must be in 0 .. {len(self.vehicle.actions) - 1}")
        self._move(int(action))
        measured = self._measure()
        value = self._sample(measured)
        fit, found = self._fit()
        reward = self._reward(fit, found)
        self.show()
        return self._observed(measured), reward, self.over, False, self._info(fit, found, value)

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """The picture, with ``render_mode="rgb_array"``; else None."""
        return self._picture() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, where there is one."""
        if self.window is not None:
            self.window.close()
            self.window = None

    def show(self) -> None:
        """Show the picture in the window, with ``render_mode="human"``."""
        if self.render_mode == "human":
            self.window = self.window or rendering.Window()
            self.window.show(self._picture())

    def _picture(self) -> NDArray[np.uint8]:
        def field(grid: Grid) -> NDArray[np.float64]:
            return self.truth.field(self.theta, self.time, grid)

        return rendering.picture(self.water.domain, field, self.samples.positions, self.state)

    def situation(self) -> Situation:
        """What a planning agent decides from; with the truth, for the oracle alone."""
        parts = self.water, self.vehicle, self.samples, self.estimate, self.theta
        noise = self.vehicle.sensor.noise or 1.0
        return Situation(*parts, noise, self.own[:3], self.time, self.steps - len(self.samples))

    def within_walls(self, own: NDArray[np.float64]) -> NDArray[np.float64]:
        """Own states (..., 4) kept within walls, heading limits and the episode's time."""
        return np.minimum(np.maximum(own, self._low), self._high)

    def resume(
        self, state: NDArray[np.float64], samples: Samples, estimate: NDArray[np.float64], previous: float
    ) -> None:
        """Go on in this episode from where somebody else has brought it, with the last fit's total error."""
        self.state, self.samples, self.estimate, self.previous = state, samples, estimate, previous
        self.time, self.over = len(samples) * self.vehicle.time_step, len(samples) == self.steps

    def _begin(self) -> None:
        self.state, self.time = self.vehicle.initial(), 0.0
        self.samples, self.previous, self.over = Samples.none(), float("nan"), False
        self.estimate = self.water.parameters.centre

    def _measure(self) -> NDArray[np.float64]:
        """The measured state, Eq. (14), which may lie beyond walls and heading limits, (3,)."""
        return self.vehicle.sensor.observe(self.state, self.np_random)

    def _observed(self, measured: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the agent sees when it measures a state (3,): within the observation space, (k,)."""
        own = np.empty(4)
        own[:3], own[3] = measured, self.time
        if self.vehicle.heading_limits is None:
            own[2] = math.remainder(own[2], 2 * math.pi)
        self.own = self.within_walls(own)
        known = Known(self.water, self.samples, self.estimate, self.vehicle.sensor.noise)
        seen = self.observation.see(self.own, known)
        return seen if seen is self.own else np.minimum(np.maximum(seen, self.low), self.high)

    def _move(self, action: int) -> None:
        self.state = self.vehicle.step(
            self.state, action, self.time, self.truth.flow, self.drift, self.water.domain
        )
        self.time = (len(self.samples) + 1) * self.vehicle.time_step

    def _sample(self, measured: NDArray[np.float64]) -> float:
        """Probe the true field at the true position; keep the sample where the vehicle believes to be."""
        at = np.array([self.time])
        field = self.truth.predict(self.theta[None], self.state[None, :2], at)[0, 0]
        value = self.vehicle.sensor.measure(field, self.np_random)
        self.samples = self.samples.append(self.water.admissible(measured[None, :2])[0], self.time, value)
        return value

    def _fit(self) -> tuple[Fit, Errors]:
        """Fit the samples so far; the episode is over after the last of them, or when enough is known."""
        last = len(self.samples) == self.steps
        fit = self._fitted(last or self.every_fold)
        enough = self.sure is not None and self.sure(self.problem, fit)
        if enough and not self.problem.leave_one_out:
            fold_0, fit = fit, self._fitted(True)
            fit = replace(fit, evaluations=fold_0.evaluations + fit.evaluations)
        self.over = enough or last
        return fit, errors(fit)

    def _fitted(self, leave_one_out: bool) -> Fit:
        parts = self.water, self.samples, self.estimator.tikhonov, leave_one_out, self.known
        self.problem = FitProblem(*parts)
        fit = self.estimator.fit(self.problem)
        self.known = fit.known
        return fit

    def _reward(self, fit: Fit, found: Errors) -> float:
        before = self.previous, self.estimate
        self.previous, self.estimate = found.e_total, fit.theta[0]
        outcome = Outcome(self.steps, found.e_total, before[0], self.problem, self.estimate, before[1])
        return float(self.reward(outcome))

    def _info(self, fit: Fit, found: Errors, value: float) -> dict[str, Any]:
        return {
            "theta": fit.theta[0],
            "e_f": found.e_f,
            "e_cv": found.e_cv,
            "e_total": found.e_total,
            "position": self.state[:2],
            "measured_position": self.samples.positions[-1],
            "heading": self.state[2],
            "time": self.time,
            "value": value,
            "evaluations": fit.evaluations,
            "converged": fit.share_converged,
            "course": fit.course,
        }
