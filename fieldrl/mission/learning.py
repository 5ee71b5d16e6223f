"""The episode and learning loops: agent and environment, step by step, into a record."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission.mission import Mission
from fieldrl.mission.record import EpisodeLog, replicate_record

Report = Callable[[int, float, float], None]


class Replicate:
    """One independent learning run, episode by episode.

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

    def learn(self, episode: int) -> None:
        """One learning episode, Algorithm 1."""
        agent, environment, rng = self.mission.agent, self.environment, self.exploration
        state = agent.begin_episode(self.agent_state)
        observation, _ = environment.reset()
        action = agent.act(state, observation, rng)
        for step in range(self.mission.steps):
            following, reward, terminated, _, info = environment.step(action)
            self.learning.write(episode, step, action, reward, following, info)
            next_action = 0 if terminated else agent.act(state, following, rng)
            state = agent.learn(state, observation, action, reward, following, next_action, terminated)
            observation, action = following, next_action
        self.agent_state = state

    def evaluate(self, episode: int) -> None:
        """One episode of the frozen greedy policy; its chance comes from streams of its own."""
        environment, agent = self.environment, self.mission.agent
        environment.np_random = stream(self.seed, "evaluation sensor", self.number, episode)
        rng = stream(self.seed, "evaluation", self.number, episode)
        observation, _ = environment.reset()
        for step in range(self.mission.steps):
            action = agent.act(self.agent_state, observation, rng, greedy=True)
            observation, reward, _, _, info = environment.step(action)
            self.evaluation.write(episode, step, action, reward, observation, info)

    def pool(self) -> NDArray[np.float64]:
        """The estimate from the samples of all learning episodes together, (p,)."""
        values = self.learning.values
        samples = Samples.of(values["measured_position"], values["time"], values["value"])
        estimator, known = self.mission.estimator, self.environment.known
        problem = FitProblem(self.mission.water, samples, estimator.tikhonov, False, known)
        return estimator.fit(problem).theta[0]

    def record(self) -> xr.Dataset:
        """What the replicate leaves, once all its episodes are done."""
        return replicate_record(self.mission, self.learning, self.evaluation, self.pool())


def run_replicate(mission: Mission, seed: int, number: int, report: Report | None = None) -> xr.Dataset:
    """Learn, evaluate, and return the record of one replicate.

    Args:
        mission: what is done.
        seed: of the run.
        number: which replicate.
        report: told (episode, return, e_total) after each learning episode.
    """
    replicate = Replicate(mission, seed, number)
    for episode in range(mission.episodes):
        replicate.learn(episode)
        if report is not None:
            values = replicate.learning.values
            report(episode, values["reward"][episode].sum(), values["e_total"][episode, -1])
    for episode in range(mission.evaluation_episodes):
        replicate.evaluate(episode)
    return replicate.record()
