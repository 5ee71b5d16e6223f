"""The episode and learning loops: agent and environment, step by step, into a record."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core.streams import stream
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission.environment import Water
from fieldrl.mission.mission import Mission, State
from fieldrl.mission.record import EpisodeLog, replicate_record
from fieldrl.mission.uncertainty_record import samples_of

Report = Callable[[int, float, float], None]


class Replicate:
    """One independent learning run, episode by episode: learning, evaluation, then the pooled estimate.

    ``state`` and ``restore`` are exact: a replicate that is restored goes on bit for bit as the one that the
    state was taken from. What only saves computing again (stores of solves) is no part of the state.

    Args:
        mission: what is done.
        seed: of the run.
        number: which replicate; its random streams depend on nothing else.
    """

    def __init__(self, mission: Mission, seed: int, number: int) -> None:
        self.mission, self.seed, self.number = mission, seed, number
        self.environment = mission.environment()
        self.environment.np_random = stream(seed, "sensor", number)
        self.exploration = stream(seed, "exploration", number)
        environment = self.environment
        self.agent_state = mission.agent.begin(
            environment.low, environment.high, len(mission.vehicle.actions)
        )
        p = len(mission.water.parameters)
        self.learning = EpisodeLog(mission.episodes, mission.steps, p)
        self.evaluation = EpisodeLog(mission.evaluation_episodes, mission.steps, p)
        self.learned = self.evaluated = 0
        self.pooled: NDArray[np.float64] | None = None

    @property
    def episodes(self) -> int:
        """Episodes that are done, evaluation included."""
        return self.learned + self.evaluated

    @property
    def finished(self) -> bool:
        """Whether nothing is left but the record."""
        return self.pooled is not None

    def advance(self) -> None:
        """The next episode or, after the last, the pooled estimate."""
        if self.learned < self.mission.episodes:
            self.learn(self.learned)
            self.learned += 1
        elif self.evaluated < self.mission.evaluation_episodes:
            self.evaluate(self.evaluated)
            self.evaluated += 1
        else:
            self.pooled = self.pool()

    def state(self) -> dict[str, Any]:
        """Everything that the next episodes and the record depend on, between two episodes.

        Returns:
            Nested dicts of arrays, numbers and text, not copied: write it down before ``advance``.
        """
        return {
            "agent": self.agent_state,
            "exploration": self.exploration.bit_generator.state,
            "sensor": self.environment.np_random.bit_generator.state,
            "known": self.environment.known,
            "learning": self.learning.state(),
            "evaluation": self.evaluation.state(),
            "learned": self.learned,
            "evaluated": self.evaluated,
            "pooled": np.empty(0) if self.pooled is None else self.pooled,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a ``state`` of the same mission, seed and number."""
        self.agent_state = state["agent"]
        self.exploration.bit_generator.state = state["exploration"]
        self.environment.np_random.bit_generator.state = state["sensor"]
        self.environment.known = state["known"]
        self.learning.restore(state["learning"])
        self.evaluation.restore(state["evaluation"])
        self.learned, self.evaluated = state["learned"], state["evaluated"]
        self.pooled = state["pooled"] if len(state["pooled"]) else None

    def report(self, report: Report) -> None:
        """Tell (episode, return, e_total) of the last learning episode."""
        last, values = self.learned - 1, self.learning.values
        report(last, values["reward"][last].sum(), values["e_total"][last, -1])

    def learn(self, episode: int) -> None:
        """One learning episode, Algorithm 1."""
        agent, environment, rng = self.mission.agent, self.environment, self.exploration
        state = agent.begin_episode(self.agent_state)
        environment.chance = self._chance(episode)
        observation, _ = environment.reset()
        self.learning.begin(episode, environment)
        action = self.choose(state, observation, rng)
        for step in range(self.mission.steps):
            following, reward, terminated, _, info = environment.step(action)
            self.learning.write(episode, step, action, reward, info)
            next_action = 0 if terminated else self.choose(state, following, rng)
            state = agent.learn(state, observation, action, reward, following, next_action, terminated)
            observation, action = following, next_action
            if terminated:
                self.learning.end(episode, step)
                break
        self.agent_state = state

    def evaluate(self, episode: int) -> None:
        """One episode of the frozen greedy policy; its chance comes from streams of its own."""
        environment = self.environment
        environment.np_random = stream(self.seed, "evaluation sensor", self.number, episode)
        environment.chance = stream(self.seed, "evaluation scenario", self.number, episode)
        rng = stream(self.seed, "evaluation", self.number, episode)
        observation, _ = environment.reset()
        self.evaluation.begin(episode, environment)
        for step in range(self.mission.steps):
            action = self.choose(self.agent_state, observation, rng, greedy=True)
            observation, reward, terminated, _, info = environment.step(action)
            self.evaluation.write(episode, step, action, reward, info)
            if terminated:
                self.evaluation.end(episode, step)
                break

    def choose(
        self, state: State, observation: NDArray[np.float64], rng: np.random.Generator, greedy: bool = False
    ) -> int:
        """The agent's next action, by observation or, where it plans, by situation."""
        agent: Any = self.mission.agent
        if hasattr(agent, "plan"):
            return agent.plan(state, self.environment.situation(), rng)
        return agent.act(state, observation, rng, greedy)

    def pool(self) -> NDArray[np.float64]:
        """The estimate from the samples of all learning episodes together, (p,); NaN where truths differ."""
        values = self.learning.values
        if self.mission.scenario.varies:
            return np.full(len(self.mission.water.parameters), np.nan)
        samples = samples_of(values, slice(None))
        estimator, known = self.mission.estimator, self.environment.known
        problem = FitProblem(self.mission.water, samples, estimator.tikhonov, False, known)
        return estimator.fit(problem).theta[0]

    def record(self) -> xr.Dataset:
        """What a finished replicate leaves."""
        if self.pooled is None:
            raise RuntimeError("a replicate has a record when it is finished")
        logs = self.learning, self.evaluation
        known, drawn = self.environment.known, stream(self.seed, "posterior", self.number)
        seed = int(drawn.integers(2**32))
        return replicate_record(self.mission, *logs, self.pooled, known, self._water, seed)

    def _chance(self, episode: int) -> np.random.Generator:
        """What the truth of a learning episode is drawn from."""
        return stream(self.seed, "scenario", self.number, episode)

    def _water(self, episode: int) -> Water:
        """The water of a learning episode, with its truth."""
        return self.mission.scenario.draw(self.mission.water, self._chance(episode))


def run_replicate(
    mission: Mission,
    seed: int,
    number: int,
    report: Report | None = None,
    keep: Callable[[Replicate], Any] | None = None,
    state: dict[str, Any] | None = None,
) -> xr.Dataset:
    """Learn, evaluate, and return the record of one replicate.

    Args:
        mission: what is done.
        seed: of the run.
        number: which replicate.
        report: told (episode, return, e_total) after each learning episode.
        keep: given the replicate after each episode and at its end; may take its state.
        state: where to go on from; None: the beginning.
    """
    replicate = Replicate(mission, seed, number)
    if state is not None:
        replicate.restore(state)
    told = 0
    while True:
        if report is not None and replicate.learned > told:
            replicate.report(report)
            told = replicate.learned
        if replicate.finished:
            return replicate.record()
        replicate.advance()
        if keep is not None:
            keep(replicate)
