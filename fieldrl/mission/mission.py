"""Everything that a learning run needs, checked as a whole before it begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.estimator.problem import Differentiable
from fieldrl.mission.environment import Estimator, FieldSampling, Reward, Water
from fieldrl.mission.reward import InformationGain
from fieldrl.vehicle.unicycle import Unicycle

State = dict[str, NDArray]


class Agent(Protocol):
    """What chooses actions. Its whole state is plain arrays."""

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


@dataclass(frozen=True)
class Mission:
    """A vehicle in a field, and how long it may learn.

    Args:
        water: forward model, domain and flow.
        vehicle: kinematics and sensor.
        agent: what chooses.
        estimator: what concludes.
        reward: what a sample is worth.
        episodes: learning episodes.
        steps: samples of an episode.
        evaluation_episodes: episodes of the frozen greedy policy after learning.
    """

    water: Water
    vehicle: Unicycle
    agent: Agent
    estimator: Estimator
    reward: Reward
    episodes: int
    steps: int
    evaluation_episodes: int = 0

    def __post_init__(self) -> None:
        checks.integer("episodes", self.episodes, 1)
        checks.integer("steps", self.steps, 1)
        checks.integer("evaluation_episodes", self.evaluation_episodes, 0)
        self._check_start()
        self._check_horizon()
        if isinstance(self.reward, InformationGain) and not isinstance(self.water, Differentiable):
            rule = "needs a model with derivatives, such as pde=advection"
            raise checks.InvalidValue("reward", "information_gain", rule, remedy="use reward=total_error")
        environment = self.environment()
        try:
            self.agent.begin(environment.low, environment.high, len(self.vehicle.actions))
        except checks.InvalidValue as error:
            raise error.within("agent") from None

    def _check_start(self) -> None:
        try:
            self.vehicle.check_start(self.water.domain)
        except checks.InvalidValue as error:
            raise error.within("vehicle") from None

    def _check_horizon(self) -> None:
        duration = self.steps * self.vehicle.time_step
        if duration > self.water.horizon * (1 + 1e-9):
            rule = f"an episode of {duration:g} must end within the model's final time {self.water.horizon:g}"
            raise checks.InvalidValue(
                "steps", self.steps, rule, "time", "fewer steps, or a later pde.final_time"
            )

    @property
    def duration(self) -> float:
        """Time at the end of an episode [time]."""
        return self.steps * self.vehicle.time_step

    def environment(self) -> FieldSampling:
        """A new environment of this mission."""
        return FieldSampling(self.water, self.vehicle, self.estimator, self.reward, self.steps)
