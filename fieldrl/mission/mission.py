"""Everything that a learning run needs, checked as a whole before it begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import field
from functools import partial
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.flow_adapter import adapted
from fieldrl.core.kinds import check_part, component
from fieldrl.estimator.problem import Differentiable, Fit, FitProblem
from fieldrl.mission import stopping
from fieldrl.mission.environment import CROSS_VALIDATION, Estimator, FieldSampling, Vehicle, Water
from fieldrl.mission.vector import FieldSamplingVector
from fieldrl.mission.world import Model, World, world
from fieldrl.observation.knowledge import Observation
from fieldrl.observation.paper import Paper
from fieldrl.reward.outcome import Reward
from fieldrl.scenario import Scenario
from fieldrl.scenario.fixed import Fixed
from fieldrl.vehicle.unicycle import Flow

State = dict[str, NDArray]


class Agent(Protocol):
    """What chooses actions. Its whole state is plain arrays.

    An agent with a method ``plan(state, situation, rng)`` is asked that instead of ``act``; see
    ``fieldrl.agent.situation``.
    """

    def begin(self, low: NDArray, high: NDArray, actions: int) -> State: ...

    def begin_episode(self, state: State) -> State: ...

    def act(
        self, state: State, observation: NDArray, rng: np.random.Generator, greedy: bool = False
    ) -> int: ...

    def learn(
        self,
        state: State,
        observation: NDArray,
        action: int,
        reward: float,
        next_observation: NDArray,
        next_action: int,
        terminated: bool,
    ) -> State: ...


class Posterior(Protocol):
    """Draws from a density within the box of scaled unknowns; see ``fieldrl.posterior.emcee``."""

    def sample(
        self, log_density: Callable[[NDArray], NDArray], starts: NDArray[np.float64], seed: int
    ) -> NDArray[np.float64]: ...


@component
class Mission:
    """A vehicle in a field, and how long it may learn.

    Args:
        water: forward model, domain and flow; what a plain model lacks, ``world`` adds.
        vehicle: kinematics and sensor.
        agent: what chooses.
        estimator: what concludes.
        reward: what a sample is worth.
        episodes: learning episodes.
        steps: samples of an episode.
        evaluation_episodes: episodes of the frozen greedy policy after learning.
        observation: what the agent sees.
        scenario: what is true in an episode.
        stop: an episode ends when the 95 % interval of each named unknown is narrower than this; None: it
            takes all its samples [unit of the unknown].
        posterior: what draws from the posterior of the unknowns at the end; None: nothing does.
        cross_validation: "every_step": e_cv and e_total are known after every sample; "as_needed": after
            every sample where the reward needs them, else after an episode's last.
    """

    water: Annotated[Water, Model]
    vehicle: Vehicle
    agent: Agent
    estimator: Estimator
    reward: Reward
    episodes: int
    steps: int
    evaluation_episodes: int = 0
    observation: Observation = field(default_factory=Paper)
    scenario: Scenario = field(default_factory=Fixed)
    stop: Mapping[str, float] | None = None
    posterior: Posterior | None = None
    cross_validation: str = CROSS_VALIDATION[0]

    def __post_init__(self) -> None:
        checks.integer("episodes", self.episodes, 1)
        checks.integer("steps", self.steps, 1)
        checks.integer("evaluation_episodes", self.evaluation_episodes, 0)
        checks.one_of("cross_validation", self.cross_validation, CROSS_VALIDATION)
        object.__setattr__(self, "water", world(self.water))
        self._check_flow()
        self._check_truth()
        self._check_start()
        self._check_horizon()
        self._check_scenario()
        if self.stop is not None:
            stopping.widths(self.stop, self.water.parameters)
        if getattr(self.reward, "needs_derivatives", False) and not isinstance(self.water, Differentiable):
            rule = "needs a model with derivatives, such as pde=advection"
            name = type(self.reward).__name__
            raise checks.InvalidValue("reward", name, rule, remedy="use reward=total_error")
        self._check_observation()
        environment = self.environment()
        try:
            self.agent.begin(environment.low, environment.high, len(self.vehicle.actions))
        except checks.InvalidValue as error:
            raise error.within("agent") from None

    def _check_flow(self) -> None:
        check_part("water.flow", self.water.flow, Flow)
        if not hasattr(adapted(self.water.flow), "kernel"):
            name = type(self.water.flow).__name__
            rule = "its velocity must take (theta, x, y, t)"
            raise checks.InvalidValue("water.flow", name, rule, remedy="see docs/flows.md")

    def _check_truth(self) -> None:
        parameters = self.water.parameters
        if not parameters.truth_known:
            known = zip(parameters.names, parameters.true, strict=True)
            unknown = ", ".join(name for name, value in known if value != value)
            rule = f"a mission simulates the true field and needs the true value of {unknown}"
            raise checks.InvalidValue(
                "water.true", list(parameters.true), rule, remedy="give it, or fit samples of your own"
            )

    def _check_start(self) -> None:
        try:
            self.vehicle.check_start(self.water.domain)
        except checks.InvalidValue as error:
            raise error.within("vehicle") from None

    def _check_observation(self) -> None:
        if getattr(self.observation, "needs_feature", False) and not hasattr(self.water, "initial"):
            rule = "needs a model with an initial feature, such as pde=advection"
            name = type(self.observation).__name__
            raise checks.InvalidValue("observation", name, rule, remedy="use observation=paper")

    def _check_scenario(self) -> None:
        if self.scenario.varies and isinstance(self.water, World):
            rule = "needs a model whose true values it can set, such as pde=advection"
            name = type(self.scenario).__name__
            raise checks.InvalidValue("scenario", name, rule, remedy="use scenario=fixed")
        try:
            self.scenario.draw(self.water, np.random.default_rng(0))
        except checks.InvalidValue as error:
            raise error.within("scenario") from None

    def _check_horizon(self) -> None:
        duration = self.steps * self.vehicle.time_step
        if duration > self.water.horizon * (1 + 1e-9):
            rule = f"an episode of {duration:g} must end within the model's final time {self.water.horizon:g}"
            raise checks.InvalidValue(
                "steps",
                self.steps,
                rule,
                "time",
                "fewer steps, a shorter vehicle.time_step or a later pde.final_time",
            )
        check_times = getattr(self.water, "check_times", None)
        if check_times is not None:
            try:
                check_times(self.vehicle.time_step * np.arange(1, self.steps + 1))
            except checks.InvalidValue as error:
                raise error.within("water") from None

    @property
    def duration(self) -> float:
        """Time at the end of an episode [time]."""
        return self.steps * self.vehicle.time_step

    def environment(self, render_mode: str | None = None) -> FieldSampling:
        """A new environment of this mission."""
        return self._environment(self.estimator, render_mode)

    def _environment(self, estimator: Estimator, render_mode: str | None) -> FieldSampling:
        parts = self.water, self.vehicle, estimator, self.reward, self.steps
        seen = self.observation, self.scenario, self._sure(), render_mode
        return FieldSampling(*parts, *seen, self.cross_validation)

    def environments(
        self, count: int, render_mode: str | None = None, autoreset_mode: str = "NextStep"
    ) -> FieldSamplingVector:
        """``count`` new environments of this mission as one; each estimator has memos of its own."""
        checks.integer("num_envs", count, 1)
        others = None if render_mode == "human" else render_mode  # one window is enough
        modes = [render_mode] + [others] * (count - 1)
        makers = [partial(self._environment, deepcopy(self.estimator), mode) for mode in modes]
        return FieldSamplingVector(makers, autoreset_mode)

    def _sure(self) -> Callable[[FitProblem, Fit], bool] | None:
        """Whether a fit tells enough for an episode to end; None where episodes take all their samples."""
        if self.stop is None:
            return None
        widths = stopping.widths(self.stop, self.water.parameters)
        return partial(stopping.sure, sensor=self.vehicle.sensor, widths=widths)
