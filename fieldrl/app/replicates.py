"""The replicates of a run: computed by workers, kept between episodes, tried again where a worker dies."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from fieldrl.app import console, notes
from fieldrl.app.checkpoints import Checkpoints, Keeper
from fieldrl.app.cluster import Cluster
from fieldrl.app.parallel import Workers, WorkersKilled
from fieldrl.app.progress import Reporter, board

if TYPE_CHECKING:
    import xarray as xr

    from fieldrl.mission import Mission

_WARM_STEPS = 3  # enough to enter every compiled loop


@dataclass(frozen=True)
class Replicate:
    """The work of one replicate, as it is sent to a worker.

    Args:
        mission: what is done.
        seed: of the run.
        reporters: where each replicate tells its progress, (replicates,).
        checkpoints: where each is kept.
        begun: when the run would have begun, had it never been interrupted [s since the epoch].
    """

    mission: Mission
    seed: int
    reporters: tuple[Reporter, ...]
    checkpoints: Checkpoints
    begun: float

    def __call__(self, number: int) -> tuple[xr.Dataset, list[str]]:
        """The record of replicate ``number``, from its last checkpoint on, and what there is to be noted."""
        from fieldrl.mission import run_replicate

        lines: list[str] = []
        with notes.told(lines.append):
            kept = self.checkpoints.read(number)
            report, keep = self.reporters[number].open(), Keeper(self.checkpoints, number, self.begun)
            state = kept.state if kept else None
            return run_replicate(self.mission, self.seed, number, report, keep, state), lines


@dataclass(frozen=True)
class Crew:
    """Who computes the replicates of a run, and for whom.

    Args:
        workers: the processes.
        replicates: how many.
        finished: told (number, record) of each replicate.
    """

    workers: Workers | Cluster
    replicates: int
    finished: Callable[[int, xr.Dataset], Any]

    def compute(
        self, mission: Mission, seed: int, checkpoints: Checkpoints, seconds: float
    ) -> list[xr.Dataset]:
        """The records of all replicates, in order.

        Args:
            mission: what is done.
            seed: of the run.
            checkpoints: where replicates are kept meanwhile.
            seconds: how long the run was computed before [s].

        Raises:
            WorkersKilled: workers were killed, and killed again.
        """
        if self.workers.count(self.replicates) > 1:
            _warm(mission)
        found: dict[int, xr.Dataset] = {}
        begun = time.time() - seconds
        try:
            self._round(found, mission, seed, checkpoints, begun)
        except WorkersKilled as error:
            console.note(f"{error.reason}; its replicates are continued from their checkpoints")
            self._round(found, mission, seed, checkpoints, begun)
        return [found[number] for number in range(self.replicates)]

    def _round(
        self,
        found: dict[int, xr.Dataset],
        mission: Mission,
        seed: int,
        checkpoints: Checkpoints,
        begun: float,
    ) -> None:
        """Compute the replicates that are not yet found, showing progress."""
        missing = [number for number in range(self.replicates) if number not in found]
        with board(self.replicates, mission.episodes, console.console(bar=True)) as reporter:
            reporters = tuple(reporter(number) for number in range(self.replicates))
            task = Replicate(mission, seed, reporters, checkpoints, begun)
            for number, (record, lines) in self.workers.run(task, missing):
                found[number] = record
                self.finished(number, record)
                for line in lines:
                    warnings.warn(line, stacklevel=2)


def _warm(mission: Mission) -> None:
    """Have every loop compiled and on disk before many workers ask for the same ones."""
    from fieldrl.mission import run_replicate

    with console.compiling():
        steps = min(mission.steps, _WARM_STEPS)
        run_replicate(replace(mission, episodes=1, steps=steps, evaluation_episodes=1), 0, 0)
