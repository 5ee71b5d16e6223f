"""How a sweep goes: find out what is finished, have the rest done, keep the books."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from fieldrl.app import console, notes
from fieldrl.app.cluster import Cluster, ClusterRunner
from fieldrl.app.sweeps import results, screen
from fieldrl.app.sweeps.composing import Composer
from fieldrl.app.sweeps.entries import Entry, build, check_objective, entry
from fieldrl.app.sweeps.objective import Objective
from fieldrl.app.sweeps.results import Row
from fieldrl.app.sweeps.sweep import Sweep, identity
from fieldrl.app.sweeps.task import Each, Outcome, Task
from fieldrl.app.sweeps.tracking import Publisher, Silence, noted, opened
from fieldrl.core.checks import FieldrlError

Draw = Callable[[Sequence[Row], Path], Any]
"""Writes the pictures of a table of results into a folder that exists."""


class SweepFailed(FieldrlError):
    """Jobs of a sweep failed, and everything about them has been said."""


class Runner(Protocol):
    """Who does the jobs; see ``pool.py``."""

    workers: int

    def warm(self) -> None:
        """Get ready while the jobs are still being composed."""
        ...

    def run(self, tasks: Mapping[int, Task], begun: Callable[[int], Any]) -> Iterator[tuple[int, Outcome]]:
        """Yield (number, outcome) of each task as it is finished."""
        ...

    def close(self) -> None:
        """Stop the workers, whatever they are doing."""
        ...


@dataclass
class Conductor:
    """Conducts one sweep, in one batch of jobs or in several.

    Args:
        composer: of the jobs' configurations.
        runner: who does the jobs.
        objective: what they are compared by.
        arguments: the overrides as typed.
        varied: the keys that the sweep varies.
        method: settings of the sweeper that decide which jobs there are.
        total: number of jobs of all batches.
    """

    composer: Composer
    runner: Runner
    objective: Objective
    arguments: tuple[str, ...]
    varied: tuple[str, ...]
    method: Mapping[str, Any]
    total: int
    entries: list[Entry] = field(default_factory=list)
    sweep: Sweep | None = None
    line: Publisher | Silence = field(default_factory=Silence)
    _open: ExitStack = field(default_factory=ExitStack)

    @property
    def rows(self) -> list[Row]:
        """The table of results so far."""
        return [found.row for found in self.entries]

    def batch(self, jobs: Sequence[Sequence[str]], with_best: bool = False) -> list[Row]:
        """Do jobs, those that are finished excepted.

        Args:
            jobs: the overrides of each.
            with_best: whether to tell the best so far with each job.

        Returns:
            Their rows of the table of results, in the order given.

        Raises:
            FieldrlError: every job of the first batch is refused; nothing has been written then.
        """
        done = len(self.entries)
        with notes.told(console.note):  # once, though each job says so again where it is done
            new = self._planned(jobs)
        if self.sweep is None:
            self._begin(new)
        for found in self._settled(new):
            done += 1
            if with_best or not found.row.reused:
                best = results.best(self.rows, self.objective) if with_best else None
                screen.job(found.row, done, self.total, self.objective, best)
        return [found.row for found in new]

    def finish(self, draw: Draw) -> None:
        """Write, draw, track and show the results.

        Raises:
            SweepFailed: a job failed.
        """
        sweep, rows = self._begun(), self.rows
        sweep.write("results.csv", partial(results.write_csv, rows, self.objective))
        sweep.write("figures", partial(_draw_into, draw, rows))
        best = results.best(rows, self.objective)
        failed = sum(bool(row.reason) for row in rows)
        problem = self._tell_end(sweep, best, failed)
        screen.results(rows, self.objective)
        screen.ending(sweep, best, isinstance(self.line, Publisher), problem)
        if failed:
            raise SweepFailed(f"{failed} of {len(rows)} jobs failed; the same command tries them again")

    def close(self) -> None:
        """Let go of workers and locks; what MLflow believes to be running is ended."""
        try:
            self.runner.close()
            self.line.abandon()
        finally:
            self._open.close()

    def _planned(self, jobs: Sequence[Sequence[str]]) -> list[Entry]:
        """The jobs, every one checked; workers are started as soon as there is something to do."""
        known = {found.row.key: found for found in self.entries if found.job is not None}
        new = []
        for number, overrides in enumerate(jobs, len(self.entries)):
            found = entry(number, overrides, self.composer, self.varied, self.objective)
            found.twin = known.setdefault(found.row.key, found) if found.job else None
            if found.open:
                self.runner.warm()
            new.append(found)
        for found in new:
            if found.open and (found.twin is found or found.twin is None):
                build(found)
        self.entries += new
        return new

    def _begin(self, new: Sequence[Entry]) -> None:
        """Before the first batch: refuse what is wrong with all of it, then open everything."""
        accepted = next((found for found in new if found.job is not None), None)
        if accepted is None or accepted.job is None:
            raise FieldrlError(new[0].row.reason)
        check_objective(accepted, self.objective)
        if isinstance(accepted.job.workers, Cluster):
            self.runner.close()
            self.runner = ClusterRunner(accepted.job.workers)
        run = accepted.job.run
        key = identity(self.arguments, self.method)
        sweep = Sweep(run.experiment, key, run.output_dir, self.arguments)
        self._open.enter_context(sweep.held(partial(screen.waiting, sweep)))
        finished = sum(bool(found.row.summary) for found in new)
        screen.beginning(sweep, self.total, finished, self.runner.workers)
        self.sweep, self.line = sweep, opened(accepted.job.tracking, sweep)

    def _settled(self, new: Sequence[Entry]) -> Iterator[Entry]:
        """Each job when it is settled: finished before, refused, done, and the same as another at the end."""
        twins = [found for found in new if found.twin is not None and found.twin is not found]
        alone = [found for found in new if found not in twins]
        for found in alone:
            if not found.open:
                self._tell(found)
                yield found
        yield from self._computed([found for found in alone if found.open])
        for found in twins:
            if found.twin is not None:
                row = found.twin.row
                found.settle(Outcome(row.summary, row.reason), self.objective, reused=True)
                yield found

    def _computed(self, todo: Sequence[Entry]) -> Iterator[Entry]:
        by_number = {found.row.number: found for found in todo}
        tasks = {number: found.task(bar=self.runner.workers == 1) for number, found in by_number.items()}

        def begun(number: int) -> None:
            self.line.send("begin", **by_number[number].told())

        for number, outcome in self.runner.run(tasks, begun):
            found = by_number[number]
            found.settle(outcome, self.objective)
            self._tell(found, outcome.each)
            yield found

    def _tell(self, found: Entry, each: Each = ()) -> None:
        """Tell MLflow what became of a job, where it does not know."""
        if found.row.reason:
            self.line.send("failed", **found.told(), reason=found.row.reason)
        elif found.row.folder is not None and self.line.wanted(found.row.folder, self._begun()):
            self.line.send("done", **found.told(), each=each)

    def _tell_end(self, sweep: Sweep, best: Row | None, failed: int) -> str:
        tags = {"best": best.key, "best.job": best.label} if best is not None else {}
        numbers = {"jobs": float(len(self.rows)), "failed": float(failed)}
        if best is not None and best.value is not None:
            numbers[f"best/{self.objective.path}"] = best.value
        content = {"folder": str(sweep.folder), "tags": tags, "numbers": numbers}
        content["status"] = "FAILED" if failed else "FINISHED"
        if self.line.news or not noted(sweep.folder):
            self.line.send("finish", **content)
        return self.line.finish()

    def _begun(self) -> Sweep:
        if self.sweep is None:
            raise RuntimeError("no batch of this sweep has been begun")
        return self.sweep


def _draw_into(draw: Draw, rows: Sequence[Row], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    draw(rows, folder)
