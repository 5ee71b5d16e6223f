"""``parallel=serial``: one task after the other, in this process."""

from __future__ import annotations

from fieldrl.core.kinds import component
from fieldrl.parallel.processes import single_threaded
from fieldrl.parallel.workers import Begun, Results, Tasks, Workers, nobody


@component
class Serial(Workers):
    """No workers."""

    def run(self, tasks: Tasks, kind: str, begun: Begun = nobody) -> Results:
        """Yield (number, result) of each task, in the order given."""
        for number, task in tasks.items():
            begun(number)
            yield number, single_threaded(task)
