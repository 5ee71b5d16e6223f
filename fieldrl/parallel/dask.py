"""``parallel=dask``: replicates of a run, or jobs of a sweep, on a Dask cluster.

Dask is an extra (``pip install 'fieldrl[dask]'``). Results come back over the network; the jobs of a sweep
write their own folders, so the workers must see the output folder.
"""

from __future__ import annotations

import functools
from collections import deque
from typing import Any

from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.core.kinds import component
from fieldrl.parallel.processes import single_threaded
from fieldrl.parallel.workers import Begun, Results, Task, Tasks, WorkerKilled, Workers, nobody

_PATIENCE = 10  # how long a scheduler may take to answer [s]
_KILLED = "workers of the cluster were killed each time that it was tried (out of memory?)"


@component
class Dask(Workers):
    """A cluster.

    Args:
        address: of the scheduler, tcp://HOST:PORT.
    """

    address: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.address, str) or "://" not in self.address:
            rule, remedy = (
                "must be a scheduler's tcp://HOST:PORT",
                "`dask scheduler` prints it when it starts",
            )
            raise InvalidValue("address", self.address, rule, remedy=remedy)

    @property
    def size(self) -> int:
        """How many tasks the cluster does at a time.

        Raises:
            FieldrlError: Dask is not installed, or no scheduler with a worker answers.
        """
        return sum(_client(str(self.address)).nthreads().values())

    def run(self, tasks: Tasks, kind: str, begun: Begun = nobody) -> Results:
        """Yield (number, result) of each task; Dask itself tries again where a worker dies."""
        client, size, left = _client(str(self.address)), self.size, deque(tasks)
        from distributed import KilledWorker, as_completed

        numbers: dict[Any, int] = {}
        answers: Any = as_completed(loop=client.loop)
        try:
            while left or numbers:
                while left and len(numbers) < size:
                    number = left.popleft()
                    begun(number)
                    future = client.submit(_here, tasks[number], pure=False)
                    numbers[future] = number
                    answers.add(future)
                future = next(answers)
                killed, number = isinstance(future.exception(), KilledWorker), numbers.pop(future)
                yield number, WorkerKilled(f"{kind} {number}: {_KILLED}") if killed else future.result()
        finally:
            client.cancel(list(numbers))


@functools.cache
def _client(address: str) -> Any:
    """The connection; the same for the whole process."""
    try:
        from distributed import Client
    except ImportError as error:
        raise FieldrlError("parallel=dask needs an extra: pip install 'fieldrl[dask]'") from error
    try:
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
        client.wait_for_workers(1, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        reason = " ".join(str(error).split())[:60] or type(error).__name__
        rule = f"no scheduler with a worker answers ({reason})"
        raise InvalidValue("parallel.address", address, rule) from error
    return client


def _here(task: Task) -> Any:
    """A task whose files are its own: xarray would ask the cluster for a lock on each."""
    import dask.config

    with dask.config.set(scheduler="synchronous"):
        return single_threaded(task)
