"""How a sweep goes: find out what is finished, have the rest done, keep and tell what became of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from fieldrl.core.checks import FieldrlError
from fieldrl.parallel.dask import Dask
from fieldrl.parallel.serial import Serial
from fieldrl.parallel.workers import WorkerKilled, Workers
from fieldrl.runs import title, warning_lines
from fieldrl.runs.display import Display
from fieldrl.runs.folder import tracked
from fieldrl.runs.tracker import Publisher, Tracker
from fieldrl.sweeps import results
from fieldrl.sweeps.objective import Objective
from fieldrl.sweeps.sweep import Sweep, identity
from fieldrl.sweeps.sweep_job import Compose, SweepJob
from fieldrl.sweeps.task import Outcome, Task, warm

Draw = Callable[[Sequence[SweepJob], Path], Any]
"""Draws a sweep into a folder that exists."""


_NOTED = 20
"""Most jobs that the note of a sweep lists."""


class SweepFailed(FieldrlError):
    """Jobs of a sweep failed, and everything about them has been said."""


class SweepDisplay(Protocol):
    """Shows how a sweep goes."""

    def note(self, text: str) -> None:
        """A line beside the results."""

    def waiting(self, name: str, holder: str) -> None:
        """Another process, ``holder``, does the same sweep."""

    def beginning(self, sweep: Sweep, jobs: int, finished: int, workers: int) -> None:
        """So many jobs, of which some were finished before, are done by so many workers."""

    def bar(self) -> Display:
        """What shows a run that is done in this process."""
        ...

    def job(self, job: SweepJob, done: int, jobs: int, objective: Objective, best: SweepJob | None) -> None:
        """A job ended; ``best``: of all so far, where one has a value."""

    def results(self, jobs: Sequence[SweepJob], objective: Objective) -> None:
        """All jobs, those that failed apart."""

    def ending(self, sweep: Sweep, best: SweepJob | None, tracked: bool, problem: str) -> None:
        """Where everything is; ``problem``: of the tracking, in a line."""


@dataclass
class Execution:
    """One sweep being done, in one batch of jobs or in several.

    Args:
        compose: composes the jobs' configurations.
        workers: who does the jobs.
        display: shows how it goes.
        objective: what they are compared by.
        arguments: the overrides as typed.
        varied: the keys that the sweep varies.
        method: settings of the sweeper that decide which jobs there are.
        total: number of jobs of all batches.
    """

    compose: Compose
    workers: Workers
    display: SweepDisplay
    objective: Objective
    arguments: tuple[str, ...]
    varied: tuple[str, ...]
    method: Mapping[str, Any]
    total: int
    jobs: list[SweepJob] = field(default_factory=list)
    sweep: Sweep | None = None
    tracking: Tracker = field(default_factory=Tracker)
    publisher: Publisher = field(default_factory=Publisher)
    told: bool = False
    _open: ExitStack = field(default_factory=ExitStack)

    def batch(self, overrides: Sequence[Sequence[str]], tell_reused: bool = False) -> list[SweepJob]:
        """Do jobs, those that are finished excepted.

        Args:
            overrides: of each job.
            tell_reused: whether to show jobs that were finished before, too.

        Returns:
            The jobs, in the order given.

        Raises:
            FieldrlError: every job of the first batch is refused; nothing has been written then.
        """
        done = len(self.jobs)
        with warning_lines.told(self.display.note):  # once, though each job says so again where it is done
            new = self._planned(overrides)
        sweep = self.sweep or self._begin(new)
        for job in self._settled(new, sweep):
            done += 1
            if tell_reused or not job.reused:
                best = results.best(self.jobs, self.objective)
                self.display.job(job, done, self.total, self.objective, best)
        return new

    def finish(self, draw: Draw) -> None:
        """Write, draw, track and show the results.

        Raises:
            SweepFailed: a job failed.
        """
        sweep, jobs = self.sweep, self.jobs
        if sweep is None:
            raise RuntimeError("no batch of this sweep has been begun")
        sweep.write("results.csv", partial(results.write_csv, jobs, self.objective))
        sweep.write("figures", partial(_draw_into, draw, jobs))
        best = results.best(jobs, self.objective)
        failed = sum(bool(job.reason) for job in jobs)
        problem = self._close_publication(sweep, best, failed)
        self.display.results(jobs, self.objective)
        self.display.ending(sweep, best, bool(tracked(sweep.folder)), problem)
        if failed:
            raise SweepFailed(f"{failed} of {len(jobs)} jobs failed; the same command tries them again")

    def close(self) -> None:
        """Let go of workers and locks; what MLflow believes to be running is ended."""
        try:
            self.workers.close()
            self.publisher.abandon()
        finally:
            self._open.close()

    def _planned(self, overrides: Sequence[Sequence[str]]) -> list[SweepJob]:
        """The jobs, every one checked; workers are started as soon as there is something to do."""
        new = []
        for number, given in enumerate(overrides, len(self.jobs)):
            values = {key.lstrip("+~"): text for key, _, text in (item.partition("=") for item in given)}
            varied = {key: values[key] for key in self.varied if key in values}
            new.append(SweepJob(number, tuple(given), varied))
            new[-1].look_up(self.compose, self.objective)
            if new[-1].open:
                self.workers.warm(warm)
        for job in new:
            job.build()
        self.jobs += new
        return new

    def _begin(self, new: Sequence[SweepJob]) -> Sweep:
        """Before the first batch: refuse what is wrong with all of it, then open everything."""
        accepted = next((found for found in new if not found.reason), None)
        if accepted is None or accepted.job is None:
            raise FieldrlError(new[0].reason)
        accepted.check_objective(self.objective)
        if isinstance(accepted.job.workers, Dask):
            self.workers.close()
            self.workers = accepted.job.workers
        run, size = accepted.job.run, self.workers.size
        sweep = Sweep(run.experiment, identity(self.arguments, self.method), run.output_dir)
        self._open.enter_context(sweep.held(self.display.waiting))
        self.display.beginning(sweep, self.total, sum(job.reused for job in new), size)
        content = {"name": sweep.name, "key": sweep.key, "arguments": list(self.arguments)}
        content["title"] = f"{run.experiment} sweep: {title.title('', title.changes(self.arguments))}"
        content["command"] = title.command(run.experiment, self.arguments).replace("fieldrl", "fieldrl -m", 1)
        content["objective"] = self.objective.path
        self.tracking = accepted.job.tracking
        self.publisher = self.tracking.publisher(run.output_dir, run.experiment, content)
        self.sweep = sweep
        return sweep

    def _settled(self, new: Sequence[SweepJob], sweep: Sweep) -> Iterator[SweepJob]:
        """Each job when it is settled: finished before or refused, then as they are done."""
        todo = [job for job in new if job.open]
        for job in new:
            if not job.open:
                if job.folder is None or job.reason or self.tracking.wanted(job.folder, sweep.key):
                    self._tell(job, sweep)
                yield job
        yield from self._computed(todo, sweep)

    def _computed(self, todo: Sequence[SweepJob], sweep: Sweep) -> Iterator[SweepJob]:
        """Each job when it is done."""
        here = isinstance(self.workers, Serial)
        display = self.display.bar() if here else Display()
        jobs = {job.number: job for job in todo}
        tasks = {job.number: Task(job.composed, not here, display) for job in todo if job.composed}

        def begun(number: int) -> None:
            self._send("begin", run=jobs[number].told(sweep.experiment))

        with closing(self.workers.run(tasks, "job", begun)) as outcomes:
            for number, outcome in outcomes:
                if isinstance(outcome, WorkerKilled):
                    less = "fewer workers need less memory: hydra.launcher.n_jobs=1"
                    outcome = Outcome({}, f"{outcome}; {less}")
                jobs[number].settle(outcome, self.objective)
                for replicate in outcome.replicates:
                    self._send("replicate", run=jobs[number].told(sweep.experiment), **replicate)
                self._tell(jobs[number], sweep)
                yield jobs[number]

    def _tell(self, job: SweepJob, sweep: Sweep) -> None:
        """Tell the tracker what became of a job."""
        ending = {"reason": job.reason} if job.reason else {}
        self._send("failed" if job.reason else "done", run=job.told(sweep.experiment), **ending)

    def _send(self, kind: str, **content: Any) -> None:
        self.told = True
        self.publisher.send(kind, **content)

    def _close_publication(self, sweep: Sweep, best: SweepJob | None, failed: int) -> str:
        """Tell the tracker that the sweep is over, where anything of it is news; its problem, if any."""
        if not self.told and tracked(sweep.folder):
            return ""
        tags = {"best": best.key, "best.job": best.label} if best is not None else {}
        numbers = {"jobs": float(len(self.jobs)), "failed": float(failed)}
        if best is not None and best.value is not None:
            numbers[f"best/{self.objective.path}"] = best.value
        status = "FAILED" if failed else "FINISHED"
        rows = [dict(job.varied) | {"value": job.value} for job in results.ranked(self.jobs, self.objective)]
        ending = {"tags": tags, "numbers": numbers, "status": status, "rows": rows[:_NOTED]}
        self.publisher.send("close", folder=str(sweep.folder), **ending)
        return self.publisher.finish()


def _draw_into(draw: Draw, jobs: Sequence[SweepJob], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    draw(jobs, folder)
