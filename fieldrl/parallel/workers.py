"""What all workers have in common, whether their tasks are replicates of a run or jobs of a sweep."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from typing import Any

from fieldrl.core.checks import FieldrlError

Task = Callable[[], Any]
"""Work for any process: picklable, as is what it returns."""

Tasks = Mapping[int, Task]
"""By number."""

Begun = Callable[[int], Any]
"""Is told the number of a task that begins."""

Results = Generator[tuple[int, Any], None, None]
"""(number, result) of each task as it is finished."""


class WorkerKilled(FieldrlError):
    """A task's worker ended without having been told to, again and again."""


def nobody(number: int) -> None:
    """Not to be told which task begins."""


class Workers:
    """Who does tasks: an option of the group ``parallel``, or one of Hydra's launchers."""

    @property
    def size(self) -> int:
        """How many tasks are done at a time."""
        return 1

    def processes(self, count: int) -> int:
        """How many processes of this machine do ``count`` tasks."""
        return 1

    def warm(self, preload: Task) -> None:
        """Get ready, with what ``preload`` imports, while there are no tasks yet."""

    def run(self, tasks: Tasks, kind: str, begun: Begun = nobody) -> Results:
        """Do tasks.

        Args:
            tasks: by number.
            kind: what a task is called in messages ("replicate", "job").
            begun: told the number of each task that begins.

        Yields:
            (number, result) of each task as it is finished; the result is a WorkerKilled where its worker
            died each time that it was tried. The order depends on the machine, the results do not.

        Raises:
            Exception: what a task raises; the others are given up.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Stop the workers, whatever they are doing."""
