"""Replicates on many cores: the only file that knows joblib."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from fieldrl.core import checks
from fieldrl.core.checks import InvalidValue

Task = Callable[[int], Any]
"""A replicate's work: its number in, its result out. It must be picklable."""


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

    def run(self, task: Task, tasks: int) -> Iterator[tuple[int, Any]]:
        """Yield (number, result) of each task as it is finished.

        The order depends on the machine, the results do not.
        """
        if self.count(tasks) == 1:
            return (_single_threaded(task, number) for number in range(tasks))
        return self._fan_out(task, tasks)

    def _fan_out(self, task: Task, tasks: int) -> Iterator[tuple[int, Any]]:
        import joblib

        jobs = self.count(tasks)
        with joblib.parallel_config("loky", n_jobs=jobs, inner_max_num_threads=1):
            parallel: Any = joblib.Parallel(return_as="generator_unordered", pre_dispatch="all")
            with uninterrupted():
                results = parallel(joblib.delayed(_single_threaded)(task, number) for number in range(tasks))
            yield from results


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Processes that are started in here inherit that an interrupt is not for them, but for their parent."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _single_threaded(task: Task, number: int) -> tuple[int, Any]:
    """A task with one thread in linear algebra: the number of threads can change the last bits."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        return number, task(number)
