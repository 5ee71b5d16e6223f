"""The replicates of a run: computed by workers, kept between episodes, continued where a worker dies."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from fieldrl.core.checks import FieldrlError
from fieldrl.parallel.workers import WorkerKilled, Workers
from fieldrl.runs import warning_lines
from fieldrl.runs.checkpoints import Checkpoints, Keeper
from fieldrl.runs.display import Display
from fieldrl.runs.progress import Progress, shared_progress

if TYPE_CHECKING:
    import xarray as xr

    from fieldrl.mission import Mission

_WARM_STEPS = 3  # enough to enter every compiled loop


@dataclass(frozen=True)
class Replicates:
    """The replicates of a run.

    Args:
        mission: what is done.
        seed: of the run.
        count: how many.
        checkpoints: where they are kept meanwhile.
        begun: when the run would have begun, had it never been interrupted [s since the epoch].
    """

    mission: Mission
    seed: int
    count: int
    checkpoints: Checkpoints
    begun: float

    def compute(self, workers: Workers, display: Display) -> Iterator[tuple[int, xr.Dataset]]:
        """Yield (number, record) of each as it is finished.

        Raises:
            FieldrlError: a worker was killed, and killed again.
        """
        if min(workers.size, self.count) > 1:
            self._warm()
        with (
            shared_progress(self.count) as progress,
            display.progress(progress.rows(), self.mission.episodes),
        ):
            tasks = {number: partial(self.replicate, number, progress) for number in range(self.count)}
            with closing(workers.run(tasks, "replicate")) as results:
                for number, result in results:
                    if isinstance(result, WorkerKilled):
                        kept = "what is finished is kept: the same command continues"
                        raise FieldrlError(f"{result}\n{kept}; parallel.jobs=1 needs the least memory")
                    record, lines = result
                    for line in lines:
                        warnings.warn(line, stacklevel=2)
                    yield number, record

    def replicate(self, number: int, progress: Progress) -> tuple[xr.Dataset, list[str]]:
        """The record of one, from its last checkpoint on, and warnings as lines; wherever that is done."""
        from fieldrl.mission import run_replicate

        lines: list[str] = []
        with warning_lines.told(lines.append):
            kept, keep = self.checkpoints.read(number), Keeper(self.checkpoints, number, self.begun)
            state = kept.state if kept else None
            return run_replicate(self.mission, self.seed, number, progress.report(number), keep, state), lines

    def _warm(self) -> None:
        """Have every loop compiled and on disk before many workers ask for the same ones."""
        from fieldrl.mission import run_replicate

        small = replace(self.mission, episodes=1, steps=min(self.mission.steps, _WARM_STEPS))
        run_replicate(replace(small, evaluation_episodes=1), 0, 0)
