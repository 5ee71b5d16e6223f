"""What is learned: controls whose answer is known, and the paper's reward, each with and without changes."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path

from fieldrl.cli.compose import composed
from fieldrl.mission import Mission
from fieldrl.reward.outcome import Reward
from fieldrl.runs.components import mission
from pipelines.diagnosis.distance import Distance
from pipelines.experiments import SCALES, Settings, Wanted

REPLICATES = {"paper": 20, "small": 2}
FREE, ONE_START, SLOW = "vehicle.heading_limits=null", "estimator.starts=1", "agent.step_size=0.1"
HOPEFUL = "+agent.initial_value=200"
"""Values that begin above what any policy returns."""


@dataclass(frozen=True)
class Place(Settings):
    """Settings of a pipeline whose results have the folder outputs/diagnosis/."""

    @property
    def folder(self) -> Path:
        """Where tables, pictures and what is kept go; the small scale has a folder in it."""
        return Path(self.output_dir) / "diagnosis" / ("small" if self.small else "")


@dataclass(frozen=True)
class Case:
    """A mission of the first experiment.

    Args:
        overrides: what differs from ``experiment=advection``.
        reward: another than the experiment's, Eq. (19).
    """

    overrides: tuple[str, ...] = ()
    reward: Reward | None = None

    def mission(self, settings: Settings, *more: str) -> Mission:
        """The mission at a scale."""
        size = () if settings.scale == "paper" else SCALES[settings.scale]["advection"]
        made = _advection((*size, *self.overrides, *more))
        return made if self.reward is None else replace(made, reward=self.reward)

    @property
    def parts(self) -> list[str]:
        """What it depends on, as text."""
        return [*self.overrides, repr(self.reward)]


@functools.cache
def _advection(overrides: tuple[str, ...]) -> Mission:
    """The first experiment; composing it takes longer than a short run of it."""
    return mission(composed(["experiment=advection", *overrides]))


_CHEAP = ("estimator.starts=1", "estimator.iterations=1")  # fits that these rewards do not look at
_END = {size: Distance(size, delayed=True, noisy=True) for size in (100.0, 20.0, 5.0)}

CONTROLS = {
    "at every step": Case(_CHEAP, Distance()),
    "at every step, heading free": Case((*_CHEAP, FREE), Distance()),
    "at every step, noise": Case(_CHEAP, Distance(noisy=True)),
    "at the end": Case(_CHEAP, Distance(delayed=True)),
    **{f"at the end, noise, size {size:g}": Case(_CHEAP, reward) for size, reward in _END.items()},
    **{
        f"at the end, noise, size {size:g}, from 200": Case((*_CHEAP, HOPEFUL), reward)
        for size, reward in _END.items()
    },
    "at the end, noise, size 100, alpha 0.1": Case((*_CHEAP, SLOW), _END[100.0]),
    "at the end, noise, size 100, alpha 0.1, from 200": Case((*_CHEAP, SLOW, HOPEFUL), _END[100.0]),
}
"""Rewards for being near the feature, learned beside a random agent; their size is 20 where none is said."""

PAPER = {"global fits": Case(), "one start": Case((ONE_START,))}
"""The paper's reward with either estimator."""

SETTINGS = {
    "limited": ((), ("learner", "random")),
    "free": ((FREE,), ("learner", "random")),
    "from 200": ((HOPEFUL,), ("learner",)),
}
"""What is changed in it, and which agents are asked."""


def runs(settings: Settings) -> dict[tuple[str, str, str], Wanted]:
    """Recorded runs by estimator, setting and agent ("learner" or "random")."""
    size = () if settings.small else (f"replicates={REPLICATES['paper']}", "evaluation_episodes=0")
    chooses = {"learner": (), "random": ("agent=random",)}
    return {
        (estimator, setting, agent): Wanted("advection", (*size, *case.overrides, *changes, *chooses[agent]))
        for estimator, case in PAPER.items()
        for setting, (changes, agents) in SETTINGS.items()
        for agent in agents
    }
