"""A job of a sweep as a worker does it: silent, untracked, and it never raises."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldrl.app.tracking import Series, Untracked

if TYPE_CHECKING:
    from fieldrl.app.sweeps.composing import Composed

Each = Sequence[tuple[Series, Series]]
"""Metrics of every replicate, by learning and by evaluation episode; see ``metrics.each``."""


@dataclass(frozen=True)
class Outcome:
    """What became of a job.

    Args:
        summary: of the finished run; empty where it failed.
        reason: why it failed, in one to three lines; empty where it finished.
        each: what MLflow shows of its replicates; empty where only its record knows.
    """

    summary: Mapping[str, Any]
    reason: str = ""
    each: Each = ()


class Collected(Untracked):
    """Tracking that keeps what it is told, so that nobody has to read it from the record again."""

    def __init__(self) -> None:
        self.replicates: dict[int, tuple[Series, Series]] = {}

    def start(self, output_dir: Path) -> Collected:
        """Nothing to start."""
        return self

    def replicate(self, number: int, series: Series, evaluation: Series) -> None:
        """One replicate is complete."""
        self.replicates[number] = series, evaluation

    def each(self, count: int) -> Each:
        """What was told of ``count`` replicates; nothing where it was not all of them."""
        told = self.replicates
        return [told[number] for number in range(count)] if set(told) == set(range(count)) else []


@dataclass(frozen=True)
class Task:
    """One run, to be done anywhere that sees the output folder.

    Args:
        composed: its configuration, checked.
        bar: whether to show the progress of its episodes.
    """

    composed: Composed
    bar: bool = False

    def __call__(self) -> Outcome:
        """Compute the run, or find it done."""
        from fieldrl.app import console
        from fieldrl.app.errors import explain
        from fieldrl.app.job import Job, perform

        collected = Collected()
        try:
            job = Job.of(self.composed.config, self.composed.experiment, self.composed.files())
            with console.hushed(bar=self.bar):
                summary = perform(replace(job, tracking=collected))
        except Exception as error:  # whatever a run may raise; the other jobs go on
            return Outcome({}, explain(error).strip())
        return Outcome(summary, each=collected.each(summary["replicates"]))


def warm() -> None:
    """Import what every job needs."""
    import fieldrl.app.job
    import fieldrl.app.metrics
    import fieldrl.app.setup
    import fieldrl.figures  # noqa: F401
