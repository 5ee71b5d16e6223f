"""The jobs of a sweep, each checked and looked up before any of them is done."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fieldrl.core.checks import FieldrlError
from fieldrl.runs import components, title
from fieldrl.runs.configuration import Composed
from fieldrl.runs.explain import explain
from fieldrl.runs.job import Job
from fieldrl.sweeps.objective import Objective, known_paths
from fieldrl.sweeps.task import Outcome

Compose = Callable[[Sequence[str]], Composed]
"""The configuration for overrides of one value each; raises FieldrlError."""


@dataclass
class SweepJob:
    """A job of a sweep: what it is, and what became of it.

    Args:
        number: of the job, from 0.
        overrides: KEY=VALUE of every override.
        varied: the values that this sweep varies, by key, as text.
        composed: its configuration; None where it could not be composed.
        job: the run; None where its configuration is refused.
        summary: of the finished run; empty where there is none.
        value: the objective's; None where there is none.
        values: the numbers that ``value`` is the median of.
        reason: why it failed; "" where it did not.
        reused: whether the run was finished before.
    """

    number: int
    overrides: tuple[str, ...]
    varied: Mapping[str, str]
    composed: Composed | None = None
    job: Job | None = None
    summary: Mapping[str, Any] = field(default_factory=dict)
    value: float | None = None
    values: tuple[float, ...] = ()
    reason: str = ""
    reused: bool = False

    @property
    def open(self) -> bool:
        """Whether it is still to be done."""
        return not self.summary and not self.reason

    @property
    def key(self) -> str:
        """Of the run; "" where it is refused."""
        return self.job.run.key if self.job else ""

    @property
    def name(self) -> str:
        """Of the run; "" where it is refused."""
        return self.job.run.name if self.job else ""

    @property
    def folder(self) -> Path | None:
        """Of the run."""
        return self.job.run.folder if self.job else None

    @property
    def label(self) -> str:
        """The varied values as one text."""
        return " ".join(f"{key}={value}" for key, value in self.varied.items()) or self.name

    def look_up(self, compose: Compose, objective: Objective) -> None:
        """Compose and check it; it is finished before, refused with a reason, or open."""
        try:
            self.composed = compose(self.overrides)
            self.job = Job.of(self.composed.config, self.composed.experiment, {})
        except FieldrlError as error:
            self.reason = explain(error)
            return
        summary = None if self.job.config["force"] else self.job.run.summary()
        if summary is not None:
            self.job.checkpoints.remove()  # left where the run was killed after its last word
            self.settle(Outcome(summary), objective, reused=True)

    def build(self) -> None:
        """Build the components of an open job, so that it is refused now if one of them is."""
        try:
            if self.open and self.job is not None:
                components.mission(self.job.config)
        except FieldrlError as error:
            self.reason = explain(error)

    def check_objective(self, objective: Objective) -> None:
        """Refuse an objective that the summary has not, or will not have.

        Raises:
            InvalidValue: with the numbers that there are.
        """
        if self.job is not None and self.value is None:
            parameters = components.mission(self.job.config).water.parameters
            greedy = self.job.config["evaluation_episodes"] > 0
            objective.check(known_paths(parameters.names, parameters.truth_known, greedy))

    def settle(self, outcome: Outcome, objective: Objective, reused: bool = False) -> None:
        """Keep what became of it."""
        self.summary, self.reason, self.reused = outcome.summary, outcome.reason, reused
        self.value, self.values = objective.value(outcome.summary), objective.values(outcome.summary)

    def told(self, experiment: str) -> dict[str, Any]:
        """What the tracker hears of it; ``experiment``: the sweep's, for a job that is refused."""
        label, changed = " ".join(self.overrides), self.varied or title.changes(self.overrides)
        name = title.title("", changed)  # the only job of a sweep, where nothing varies, by all that it is
        if self.job is not None:
            return self.job.told(label, name)
        known = {"label": label, "experiment": experiment, "name": name}
        known["command"] = title.command(experiment, self.overrides)
        known |= {"config": self.composed.config if self.composed else {}, "key": "", "folder": ""}
        return known | {"replicates": 1, "afresh": False}
