"""A job of a sweep as a worker does it: untracked, and it never raises."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from fieldrl.parallel.serial import Serial
from fieldrl.runs.configuration import Composed
from fieldrl.runs.display import Display
from fieldrl.runs.explain import explain
from fieldrl.runs.tracker import Publisher, Tracker


@dataclass(frozen=True)
class Outcome:
    """What became of a job.

    Args:
        summary: of the finished run; empty where it failed.
        reason: why it failed, in one to three lines; empty where it finished.
        replicates: what the tracker of the sweep is told of each replicate; those of a run that was finished
            before are in its record.
    """

    summary: Mapping[str, Any]
    reason: str = ""
    replicates: list[dict[str, Any]] = field(default_factory=list)


class Collected(Tracker, Publisher):
    """Keeps what it is told of replicates, so that nobody has to read the record again."""

    def __init__(self) -> None:
        self.replicates: list[dict[str, Any]] = []

    def publisher(self, output_dir: Path, experiment: str, sweep: dict[str, Any] | None = None) -> Publisher:
        """This."""
        return self

    def send(self, kind: str, **content: Any) -> None:
        """Keep it, if it is of a replicate."""
        if kind == "replicate":
            self.replicates.append({key: value for key, value in content.items() if key != "run"})


@dataclass(frozen=True)
class Task:
    """One run, to be done anywhere that sees the output folder.

    Args:
        composed: its configuration, checked.
        alone: whether its replicates stay in the process that does it.
        display: shows how it goes.
    """

    composed: Composed
    alone: bool = True
    display: Display = field(default_factory=Display)

    def __call__(self) -> Outcome:
        """Compute the run, or find it done."""
        from fieldrl.runs.job import Job, perform

        collected = Collected()
        try:
            job = Job.of(self.composed.config, self.composed.experiment, self.composed.files())
            workers = Serial() if self.alone else job.workers
            summary = perform(replace(job, tracking=collected, workers=workers), self.display)
        except Exception as error:  # whatever a run may raise; the other jobs go on
            return Outcome({}, explain(error).strip())
        return Outcome(summary, replicates=collected.replicates)


def warm() -> None:
    """Import what every job needs."""
    import fieldrl.figures
    import fieldrl.runs.job
    import fieldrl.runs.metrics  # noqa: F401
