"""The jobs of a sweep, each checked and looked up before any of them is done."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from fieldrl.app.errors import explain
from fieldrl.app.job import Job
from fieldrl.app.sweeps.composing import Composed, Composer
from fieldrl.app.sweeps.objective import Objective, known_paths
from fieldrl.app.sweeps.results import Row
from fieldrl.app.sweeps.task import Outcome, Task
from fieldrl.core.checks import FieldrlError


@dataclass
class Entry:
    """A job of the sweep: what it is, and what became of it.

    Args:
        row: its row of the table of results.
        job: the run; None where it is refused.
        composed: its configuration; None where it could not be composed.
        twin: an earlier job that is the same run.
    """

    row: Row
    job: Job | None = None
    composed: Composed | None = None
    twin: Entry | None = None

    @property
    def open(self) -> bool:
        """Whether it is still to be done."""
        return self.job is not None and not self.row.summary and not self.row.reason

    def task(self, bar: bool) -> Task:
        """Its work."""
        if self.composed is None:
            raise ValueError("a job that is refused has no work")
        return Task(self.composed, bar)

    def settle(self, outcome: Outcome, objective: Objective, reused: bool = False) -> None:
        """Put down what became of it."""
        value, values = objective.value(outcome.summary), objective.values(outcome.summary)
        self.row = replace(
            self.row,
            summary=outcome.summary,
            reason=outcome.reason,
            value=value,
            values=values,
            reused=reused,
        )

    def told(self) -> dict[str, Any]:
        """What MLflow hears about it."""
        return {
            "job": " ".join(self.row.overrides),
            "name": self.row.name,
            "key": self.row.key,
            "folder": str(self.row.folder or ""),
            "config": self.composed.config if self.composed else {},
        }


def entry(
    number: int, overrides: Sequence[str], composer: Composer, varied: Sequence[str], objective: Objective
) -> Entry:
    """A job: finished before, refused with a reason, or to be done.

    Args:
        number: of the job.
        overrides: KEY=VALUE, one value each.
        composer: composes its configuration.
        varied: the keys that the sweep varies.
        objective: what jobs are compared by.
    """
    given = {key.lstrip("+~"): text for key, _, text in (item.partition("=") for item in overrides)}
    found = Entry(Row(number, tuple(overrides), {key: given[key] for key in varied if key in given}))
    try:
        found.composed = composer(overrides)
        found.job = job = Job.of(found.composed.config, found.composed.experiment, {})
    except FieldrlError as error:
        found.row = replace(found.row, reason=explain(error))
        return found
    found.row = replace(found.row, key=job.run.key, name=job.run.name, folder=job.run.folder)
    summary = None if job.config["force"] else job.run.summary()
    if summary is not None:
        found.settle(Outcome(summary), objective, reused=True)
    return found


def build(found: Entry) -> None:
    """Build the components of a job that is to be done; refuse it where one of them is refused."""
    from fieldrl.app import setup

    if found.job is None:
        return
    try:
        setup.mission(found.job.config)
    except FieldrlError as error:
        found.job, found.row = None, replace(found.row, reason=explain(error))


def check_objective(found: Entry, objective: Objective) -> None:
    """Refuse an objective that the summary of a job has not, or will not have.

    Raises:
        InvalidValue: with the numbers that there are.
    """
    from fieldrl.app import setup

    if found.job is None or (found.row.summary and found.row.value is not None):
        return
    parameters = setup.mission(found.job.config).water.parameters
    greedy = found.job.config["evaluation_episodes"] > 0
    objective.check(known_paths(parameters.names, parameters.true is not None, greedy))
