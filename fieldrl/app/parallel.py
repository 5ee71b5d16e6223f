"""Replicates on many cores: the only file that knows joblib."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from typing import Any

from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue

Task = Callable[[int], Any]
"""A replicate's work: its number in, its result out. It must be picklable."""


_GLANCE = 0.2  # how often a worker looks whether its parent lives [s]


class WorkersKilled(FieldrlError):
    """A worker process ended without having been told to.

    Args:
        reason: what is known of it, one line.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason

    def __str__(self) -> str:
        return (
            f"{self.reason}, and again when it was tried once more\n"
            "what is finished is kept: the same command continues; parallel.jobs=1 needs the least memory"
        )


@dataclass(frozen=True)
class Workers:
    """Worker processes on this machine.

    Args:
        jobs: how many; -1 for one a core. With 1 everything stays in this process.
    """

    jobs: int = -1

    def __post_init__(self) -> None:
        checks.integer("jobs", self.jobs)
        if self.jobs != -1 and self.jobs < 1:
            raise InvalidValue("jobs", self.jobs, "must be -1 (all cores) or >= 1")

    def count(self, tasks: int) -> int:
        """How many processes ``tasks`` tasks get; one within a worker of a sweep."""
        if multiprocessing.parent_process() is not None:
            return 1
        return min(tasks, cores() if self.jobs == -1 else self.jobs)

    def run(self, task: Task, numbers: Sequence[int]) -> Iterator[tuple[int, Any]]:
        """Yield (number, result) of the task for each number as it is finished.

        The order depends on the machine, the results do not.

        Raises:
            WorkersKilled: a worker process was killed; what was yielded before is complete.
        """
        if self.count(len(numbers)) <= 1:
            return (single_threaded(task, number) for number in numbers)
        return self._fan_out(task, numbers)

    def _fan_out(self, task: Task, numbers: Sequence[int]) -> Iterator[tuple[int, Any]]:
        import joblib
        from joblib.externals.loky import BrokenProcessPool

        jobs = self.count(len(numbers))
        try:
            ours = {"initializer": end_with_parent, "initargs": (os.getpid(),)}
            with joblib.parallel_config("loky", n_jobs=jobs, inner_max_num_threads=1, **ours):
                parallel: Any = joblib.Parallel(return_as="generator_unordered", pre_dispatch="all")
                with uninterrupted():
                    results = parallel(joblib.delayed(single_threaded)(task, number) for number in numbers)
                yield from results
        except BrokenProcessPool as error:
            raise WorkersKilled("a worker process was killed (out of memory?)") from error


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _loky_tracker() -> Any:
    from joblib.externals.loky.backend import resource_tracker as tracker

    return tracker


def _start_trackers() -> None:
    """Start the processes that clean up after a run that was killed; what they find is no news to a user."""
    before = os.environ.get("PYTHONWARNINGS")
    quiet = "ignore:resource_tracker:UserWarning"
    os.environ["PYTHONWARNINGS"] = f"{before},{quiet}" if before else quiet
    try:
        for tracker in (resource_tracker, _loky_tracker()):
            tracker.ensure_running()
    finally:
        if before is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = before


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Processes that are started in here inherit that an interrupt is not for them, but for their parent."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    _start_trackers()  # starting one ends the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with_parent(parent: int) -> None:
    """Have this worker process end when its parent has: what was killed computes no longer."""

    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(_GLANCE)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def single_threaded(task: Task, number: int) -> tuple[int, Any]:
    """(number, result) of a task, with one thread in linear algebra: more can change the last bits."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        return number, task(number)
