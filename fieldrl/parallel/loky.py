"""``parallel=loky``: worker processes on this machine; one that dies costs its own task alone.

joblib's pool of workers is one: where one of them is killed, all are, and nobody knows whose task it was.
Here each worker is a loky executor of its own, with one process that stays warm from task to task.
"""

from __future__ import annotations

import functools
import multiprocessing
import os
import time
import warnings
from collections import Counter, deque
from collections.abc import Iterator, Set
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Any

from fieldrl.core import checks
from fieldrl.core.checks import InvalidValue
from fieldrl.core.kinds import component
from fieldrl.parallel.processes import cores, end_with_parent, uninterrupted
from fieldrl.parallel.serial import Serial
from fieldrl.parallel.workers import Begun, Results, Task, Tasks, WorkerKilled, Workers, nobody

ATTEMPTS = 2
"""How often a task is tried whose worker is killed."""

_TO_BEGIN = 5.0  # seconds
_THREADS = ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB", "NUMEXPR")


class Pool(Workers):
    """Worker processes.

    Args:
        size: how many; -1 for one a core.
    """

    def __init__(self, size: int = -1) -> None:
        self._size = cores() if size == -1 else size
        self._executors: dict[Any, Future] = {}  # all (an interrupt may leave one neither idle nor busy)
        self._idle: list[Any] = []
        self._busy: dict[Future, tuple[Any, int]] = {}

    @property
    def size(self) -> int:
        """How many processes there are at most."""
        return self._size

    def warm(self, preload: Task) -> None:
        """Start the workers now, so that they import while there are no tasks yet."""
        while len(self._idle) + len(self._busy) < self.size:
            self._idle.append(self._started(preload)[0])

    def run(self, tasks: Tasks, kind: str, begun: Begun = nobody) -> Results:
        """Yield (number, result) of each task; one whose worker is killed is given to a new worker, once."""
        left, tried = deque(tasks), Counter[int]()
        try:
            while left or self._busy:
                while left and len(self._busy) < self.size:
                    number = left.popleft()
                    tried[number] += 1
                    begun(number)
                    self._submit(number, tasks[number])
                for number, future in self._finished():
                    if future is not None:
                        yield number, future.result()
                    elif tried[number] < ATTEMPTS:
                        again = f"{kind} {number}: its worker was killed (out of memory?)"
                        warnings.warn(f"{again}; the {kind} is tried once more", stacklevel=2)
                        left.appendleft(number)
                    else:
                        twice = f"{kind} {number}: its worker was killed twice (out of memory?)"
                        yield number, WorkerKilled(twice)
        finally:
            self._stop(self._executors.keys() - self._idle)
            self._busy = {}

    def close(self) -> None:
        """Stop the workers, whatever they are doing."""
        self._stop(self._executors.keys())
        self._idle, self._busy = [], {}

    def _submit(self, number: int, task: Task) -> None:
        executor = self._idle.pop() if self._idle else None
        try:
            executor, future = (executor, executor.submit(task)) if executor else self._started(task)
        except RuntimeError:  # it died while it was idle
            executor, future = self._started(task)
        self._executors[executor] = future
        self._busy[future] = executor, number

    def _finished(self) -> Iterator[tuple[int, Future | None]]:
        """Wait for a task; its number, and its future or None where its worker died."""
        from joblib.externals.loky.process_executor import BrokenProcessPool

        done, _ = wait(self._busy, return_when=FIRST_COMPLETED)
        for future in done:
            executor, number = self._busy.pop(future)
            if isinstance(future.exception(), BrokenProcessPool):
                self._stop({executor})
                yield number, None
            else:
                self._idle.append(executor)
                yield number, future

    def _started(self, task: Task) -> tuple[Any, Future]:
        """A new process, and its first task."""
        from joblib.externals.loky.backend.context import get_context
        from joblib.externals.loky.process_executor import ProcessPoolExecutor

        environment = {f"{library}_NUM_THREADS": "1" for library in _THREADS}
        ours = {"initializer": end_with_parent, "initargs": (os.getpid(),)}
        with uninterrupted():
            executor = ProcessPoolExecutor(1, context=get_context("loky"), env=environment, **ours)
            self._executors[executor] = executor.submit(task)
            return executor, self._executors[executor]

    def _stop(self, executors: Set[Any]) -> None:
        for executor in list(executors):
            _await_begun(self._executors[executor])
            executor.shutdown(wait=True, kill_workers=True)
            del self._executors[executor]


def _await_begun(task: Future) -> None:
    """Wait for loky's thread to take the task: it fails where its executor is shut down before that."""
    end = time.monotonic() + _TO_BEGIN
    while not (task.running() or task.done()) and time.monotonic() < end:
        time.sleep(0.001)


@component
class Loky(Workers):
    """Worker processes that stay for the runs to come.

    Args:
        jobs: how many; -1 for one a core. With 1 everything stays in this process.
    """

    jobs: int = -1

    def __post_init__(self) -> None:
        checks.integer("jobs", self.jobs)
        if self.jobs != -1 and self.jobs < 1:
            raise InvalidValue("jobs", self.jobs, "must be -1 (all cores) or >= 1")

    @property
    def size(self) -> int:
        """How many tasks are done at a time; one within a worker of a sweep."""
        if multiprocessing.parent_process() is not None:
            return 1
        return cores() if self.jobs == -1 else self.jobs

    def processes(self, count: int) -> int:
        """How many processes of this machine do ``count`` tasks."""
        return min(self.size, count)

    def run(self, tasks: Tasks, kind: str, begun: Begun = nobody) -> Results:
        """As a pool does, or in this process where that is as good."""
        return (Serial() if min(self.size, len(tasks)) <= 1 else self._pool).run(tasks, kind, begun)

    def close(self) -> None:
        """Stop the workers."""
        self._pool.close()

    @property
    def _pool(self) -> Pool:
        return _shared(self.size, os.getpid())


@functools.cache
def _shared(size: int, process: int) -> Pool:
    return Pool(size)
