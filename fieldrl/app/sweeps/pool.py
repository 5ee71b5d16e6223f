"""Jobs on many cores, so that a worker that dies costs its own job alone.

joblib's pool of workers is one: where one of them is killed, all are, and nobody knows whose job it was. Here
each worker is a loky executor of its own, with one process that stays warm from job to job.
"""

from __future__ import annotations

import os
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Any

from fieldrl.app.parallel import cores, end_with_parent, uninterrupted
from fieldrl.app.sweeps.task import Outcome, Task, warm

ATTEMPTS = 2
"""How often a job is tried whose worker is killed."""

_THREADS = ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB", "NUMEXPR")
AGAIN = "job {number}: its worker was killed (out of memory?); the job is tried once more"
KILLED = "its worker was killed twice (out of memory?); fewer workers need less: hydra.launcher.n_jobs=1"


class Here:
    """No workers: one job after the other in this process."""

    workers = 1

    def warm(self) -> None:
        """Nothing to start."""

    def run(self, tasks: Mapping[int, Task], begun: Callable[[int], Any]) -> Iterator[tuple[int, Outcome]]:
        """Yield (number, outcome) of each task; ``begun`` hears the number of each that begins."""
        for number, task in tasks.items():
            begun(number)
            yield number, task()

    def close(self) -> None:
        """Nothing to stop."""


class Pool:
    """Worker processes.

    Args:
        workers: how many; -1 for one a core.
    """

    def __init__(self, workers: int = -1) -> None:
        self.workers = cores() if workers == -1 else workers
        self._idle: list[Any] = []
        self._busy: dict[Future, tuple[Any, int]] = {}

    def warm(self) -> None:
        """Start the workers now, so that they import while the jobs are still being composed."""
        while len(self._idle) + len(self._busy) < self.workers:
            self._idle.append(_executor())

    def run(self, tasks: Mapping[int, Task], begun: Callable[[int], Any]) -> Iterator[tuple[int, Outcome]]:
        """Yield (number, outcome) of each task as it is finished; ``begun`` hears which begins.

        A task whose worker is killed is given to a new worker, once.
        """
        left, tried = deque(tasks), dict.fromkeys(tasks, 0)
        while left or self._busy:
            while left and len(self._busy) < self.workers:
                self._submit(left.popleft(), tasks, tried, begun)
            for number, outcome in self._finished():
                if outcome is not None:
                    yield number, outcome
                elif tried[number] < ATTEMPTS:
                    warnings.warn(AGAIN.format(number=number), stacklevel=2)
                    left.appendleft(number)
                else:
                    yield number, Outcome({}, KILLED)

    def close(self) -> None:
        """Stop the workers, whatever they are doing."""
        for executor in (*self._idle, *(executor for executor, _ in self._busy.values())):
            executor.shutdown(wait=True, kill_workers=True)
        self._idle, self._busy = [], {}

    def _submit(self, number: int, tasks: Mapping[int, Task], tried: dict[int, int], begun: Callable) -> None:
        tried[number] += 1
        executor = self._idle.pop() if self._idle else _executor()
        begun(number)
        try:
            future = executor.submit(tasks[number])
        except RuntimeError:  # it died while it was idle
            executor = _executor()
            future = executor.submit(tasks[number])
        self._busy[future] = executor, number

    def _finished(self) -> Iterator[tuple[int, Outcome | None]]:
        """Wait for a task; its number, and its outcome or None where its worker died."""
        from joblib.externals.loky.process_executor import BrokenProcessPool

        done, _ = wait(self._busy, return_when=FIRST_COMPLETED)
        for future in done:
            executor, number = self._busy.pop(future)
            try:
                outcome = future.result()
            except BrokenProcessPool:
                executor.shutdown(wait=True, kill_workers=True)
                yield number, None
            else:
                self._idle.append(executor)
                yield number, outcome


def _executor() -> Any:
    """A process that imports and then waits for work."""
    from joblib.externals.loky.backend.context import get_context
    from joblib.externals.loky.process_executor import ProcessPoolExecutor

    environment = {f"{library}_NUM_THREADS": "1" for library in _THREADS}
    ours = {"initializer": end_with_parent, "initargs": (os.getpid(),)}
    with uninterrupted():
        executor = ProcessPoolExecutor(1, context=get_context("loky"), env=environment, **ours)
        executor.submit(warm)
    return executor
