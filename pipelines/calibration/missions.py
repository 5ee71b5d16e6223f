"""Simulated missions: a truth drawn evenly from the bounds, an agent's path, samples, their noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.cli.compose import composed
from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.problem import Fit, FitProblem
from fieldrl.mission import Mission
from fieldrl.mission.environment import FieldSampling, Water
from fieldrl.mission.learning import Replicate
from fieldrl.runs.components import mission

SEED = 0
SIZES = (3, 5, 10, 20)
"""Samples of a mission: the first of its path, or of two paths one after the other where one has but ten."""

AGENTS = ("random", "lawnmower", "learned")
TRAINING = {"advection": "episodes=100", "double_gyre": "episodes=10"}
"""How long the learned agent learns, of the configuration's own truth; then it is greedy."""


class Unfitted:
    """An estimator that does nothing: a path needs no fit."""

    tikhonov = 0.0

    def fit(self, problem: FitProblem) -> Fit:
        """The centre of the bounds, without residuals."""
        n, centre = len(problem.samples), problem.model.parameters.centre
        return Fit(
            np.tile(centre, (n + 1, 1)), np.zeros(n + 1), np.zeros((n + 1, n)), 0, np.empty((0, len(centre)))
        )


def unpaid(outcome: Any) -> float:
    """The reward where nothing is learned."""
    return 0.0


@dataclass(frozen=True, eq=False)
class World:
    """An experiment of fieldrl with one of the agents.

    Args:
        experiment: of ``conf/experiment``.
        agent: one of ``AGENTS``.
        overrides: of its configuration.
    """

    experiment: str
    agent: str
    overrides: tuple[str, ...] = ()

    @cached_property
    def mission(self) -> Mission:
        """As configured, with the experiment's own agent."""
        training = TRAINING[self.experiment]
        return mission(composed([f"experiment={self.experiment}", training, *self.overrides]))

    @cached_property
    def learned(self) -> dict[str, NDArray]:
        """What the experiment's own agent knows after its training."""
        replicate = Replicate(self.mission, SEED, 0)
        for episode in range(self.mission.episodes):
            replicate.learn(episode)
        return replicate.agent_state

    @property
    def water(self) -> Water:
        """The model, with the configuration's truth."""
        return self.mission.water

    @property
    def noise(self) -> float:
        """Standard deviation of a sample [field unit]."""
        return self.mission.vehicle.sensor.noise

    def drawn(self, number: int) -> Simulated:
        """Mission ``number``: its truth, its paths and its noise have streams of their own."""
        paths = -(-SIZES[-1] // self.mission.steps)
        truth, positions, times, clean = self.run(number, paths)
        labels = np.repeat(np.arange(paths), self.mission.steps)
        noise = self.noise * self._stream("noise", number).standard_normal(clean.size)
        return Simulated(
            with_truth(self.water, truth), truth, positions.reshape(-1, 2), times.ravel(), clean.ravel(),
            noise, labels,
        )  # fmt: skip

    def run(self, number: int, paths: int) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """A truth (p,), so many paths in its flow, and the true field along them.

        Returns:
            The truth, positions (paths, steps, 2), times and values without noise (paths, steps).
        """
        parameters = self.water.parameters
        truth = self._stream("truth", number).uniform(parameters.lower, parameters.upper)
        environment = self._environment(with_truth(self.water, truth))
        parts = [self._path(environment, number, path) for path in range(paths)]
        positions, times, clean = (
            np.stack([getattr(part, name) for part in parts]) for name in ("positions", "times", "values")
        )
        return truth, positions, times, clean

    def _path(self, environment: FieldSampling, number: int, path: int) -> Samples:
        """The samples of an episode."""
        agent, state = self._agent(environment)
        state = agent.begin_episode(state)
        environment.np_random = self._stream("sensor", number, path)
        rng = self._stream("agent", number, path)
        observation, _ = environment.reset()
        for _ in range(self.mission.steps):
            action = agent.act(state, observation, rng, greedy=self.agent == "learned")
            observation, *_ = environment.step(action)
        return environment.samples

    def _stream(self, name: str, *indices: int) -> np.random.Generator:
        return stream(SEED, f"calibration {self.experiment} {self.agent} {name}", *indices)

    @cached_property
    def _other(self) -> Any:
        """The agent, where it does not learn."""
        return mission(composed([f"experiment={self.experiment}", f"agent={self.agent}"])).agent

    def _agent(self, environment: FieldSampling) -> tuple[Any, Any]:
        """Agent and its state as an episode begins."""
        if self.agent == "learned":
            return self.mission.agent, self.learned
        actions = len(self.mission.vehicle.actions)
        return self._other, self._other.begin(environment.low, environment.high, actions)

    def _environment(self, water: Water) -> FieldSampling:
        """One whose probe has no noise, so that its values are the true field."""
        vehicle: Any = self.mission.vehicle
        clear = replace(vehicle, sensor=replace(vehicle.sensor, noise=0.0))
        return replace(
            self.mission, water=water, vehicle=clear, estimator=Unfitted(), reward=unpaid
        ).environment()


@dataclass(frozen=True, eq=False)
class Simulated:
    """What a mission was and saw.

    Args:
        water: the model, with the true parameters.
        truth: they, (p,).
        positions: of the samples, (n, 2) [length].
        times: (n,) [time].
        clean: the true field there, (n,) [field unit].
        noise: of the samples, (n,) [field unit].
        paths: which path each belongs to, (n,).
    """

    water: Water
    truth: NDArray[np.float64]
    positions: NDArray[np.float64]
    times: NDArray[np.float64]
    clean: NDArray[np.float64]
    noise: NDArray[np.float64]
    paths: NDArray[np.int64]

    def field_of(self, water: Water) -> NDArray[np.float64]:
        """The true field of a world at the samples, (n,) [field unit]."""
        return water.truth().predict(self.truth[None], self.positions, self.times)[0]

    def samples(self, n: int, values: NDArray | None = None) -> Samples:
        """The first n; with other values than the true field and its noise, where given."""
        values = self.clean + self.noise if values is None else values
        return Samples.of(self.positions[:n], self.times[:n], values[:n])


def with_truth(water: Water, truth: NDArray, **changes: Any) -> Water:
    """The same model of a world with another truth."""
    return replace(water, true=tuple(truth.tolist()), **changes)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=8)
def world(experiment: str, agent: str, overrides: tuple[str, ...] = ()) -> World:
    """One for each process: its agent is trained once."""
    return World(experiment, agent, overrides)
