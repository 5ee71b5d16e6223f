"""Work on a Dask cluster: replicates of a run by joblib's Dask backend, jobs of a sweep one by one.

Dask is an extra (``pip install 'fieldrl[dask]'``). Results come back over the network; the jobs of a sweep
write their own folders, so the workers must see the output folder.
"""

from __future__ import annotations

import functools
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from fieldrl.app.errors import explain, first_line
from fieldrl.app.parallel import Task, WorkersKilled, single_threaded
from fieldrl.core.checks import FieldrlError, InvalidValue

_PATIENCE = 10  # how long a scheduler may take to answer [s]
_ALONE = {"_target_": "fieldrl.app.parallel.Workers", "jobs": 1}


@dataclass(frozen=True)
class Cluster:
    """``parallel=dask``.

    Args:
        address: of the scheduler, tcp://HOST:PORT.
    """

    address: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.address, str) or "://" not in self.address:
            remedy = "`dask scheduler` prints it when it starts"
            raise InvalidValue(
                "address", self.address, "must be a scheduler's tcp://HOST:PORT", remedy=remedy
            )

    @property
    def client(self) -> Any:
        """The connection; the same for the whole process.

        Raises:
            FieldrlError: Dask is not installed, or no scheduler with a worker answers.
        """
        return _client(str(self.address))

    def size(self) -> int:
        """How many tasks the cluster does at a time."""
        return sum(self.client.nthreads().values())

    def count(self, tasks: int) -> int:
        """How many of ``tasks`` tasks are done at a time."""
        return min(tasks, self.size())

    def run(self, task: Task, numbers: Sequence[int]) -> Iterator[tuple[int, Any]]:
        """Yield (number, result) of the task for each number as it is finished.

        Raises:
            WorkersKilled: workers were killed each time that Dask tried.
        """
        import joblib

        client, jobs = self.client, self.count(len(numbers))
        from distributed import KilledWorker

        try:
            with joblib.parallel_config("dask", client=client):
                parallel: Any = joblib.Parallel(return_as="generator_unordered", n_jobs=jobs)
                yield from parallel(joblib.delayed(_local)(task, number) for number in numbers)
        except KilledWorker as error:
            raise WorkersKilled("workers of the cluster were killed (out of memory?)") from error


class ClusterRunner:
    """Does the jobs of a sweep on a cluster; see ``sweeps.conduct.Runner``.

    Args:
        cluster: where.
    """

    def __init__(self, cluster: Cluster) -> None:
        self.cluster = cluster
        self.workers = cluster.size()

    def warm(self) -> None:
        """Workers of a cluster are there already."""

    def run(self, tasks: Mapping[int, Any], begun: Callable[[int], Any]) -> Iterator[tuple[int, Any]]:
        """Yield (number, outcome) of each task as it is finished; Dask tries again where a worker dies."""
        from distributed import as_completed

        client, left, numbers = self.cluster.client, deque(tasks), {}
        answers: Any = as_completed(loop=client.loop)
        while left or numbers:
            while left and len(numbers) < self.workers:
                number = left.popleft()
                future = client.submit(_job, _alone(tasks[number]), pure=False)
                numbers[future.key] = number
                begun(number)
                answers.add(future)
            future = next(answers)
            yield numbers.pop(future.key), _outcome(future)

    def close(self) -> None:
        """What still waits is given up with the connection."""


@functools.cache
def _client(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise FieldrlError("parallel=dask needs an extra: pip install 'fieldrl[dask]'") from error
    try:
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
        client.wait_for_workers(1, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        remedy = f"no scheduler with a worker answers ({first_line(error)[:60]})"
        raise InvalidValue("parallel.address", address, remedy) from error
    return client


def _alone(task: Any) -> Any:
    """The task with its replicates one after the other, where it is done."""
    config = {**task.composed.config, "parallel": _ALONE}
    return replace(task, composed=replace(task.composed, config=config), bar=False)


def _job(task: Any) -> Any:
    """A job with one thread in linear algebra, as everywhere."""
    return _local(lambda _: task(), 0)[1]


def _local(task: Task, number: int) -> tuple[int, Any]:
    """A task whose files are its own: xarray would ask the cluster for a lock on each."""
    import dask.config

    with dask.config.set(scheduler="synchronous"):
        return single_threaded(task, number)


def _outcome(future: Any) -> Any:
    from fieldrl.app.sweeps.task import Outcome

    try:
        return future.result()
    except Exception as error:  # a worker that was killed again and again
        return Outcome({}, explain(error))
