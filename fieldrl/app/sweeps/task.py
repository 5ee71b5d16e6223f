"""A job of a sweep as a worker does it: silent, untracked, and it never raises."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fieldrl.app.sweeps.composing import Composed


@dataclass(frozen=True)
class Outcome:
    """What became of a job.

    Args:
        summary: of the finished run; empty where it failed.
        reason: why it failed, in one to three lines; empty where it finished.
        seconds: from beginning to end, at the worker [s].
    """

    summary: Mapping[str, Any]
    reason: str = ""
    seconds: float = 0.0


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
        from fieldrl.app.tracking import Untracked

        started = time.perf_counter()
        try:
            job = Job.of(self.composed.config, self.composed.experiment, self.composed.files())
            with console.hushed(bar=self.bar):
                summary = perform(replace(job, tracking=Untracked()))
        except Exception as error:  # whatever a run may raise; the other jobs go on
            return Outcome({}, explain(error).strip(), time.perf_counter() - started)
        return Outcome(summary, "", time.perf_counter() - started)


def warm() -> None:
    """Import what every job needs; end when the sweep has ended."""
    import fieldrl.app.job
    import fieldrl.app.metrics
    import fieldrl.app.setup
    import fieldrl.figures  # noqa: F401
    from fieldrl.app.parallel import end_with_parent

    end_with_parent()
