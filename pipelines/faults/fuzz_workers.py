"""Worker processes that run command lines which may do anything: hang, grow, leave files, or die."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import psutil

VERDICTS = {
    "refused": "refused in 1 to 3 lines that name the key",
    "ran": "ran to the end",
    "long": "accepted, not run: estimated to take long",
    "unclear": "refused, but unclear",
    "unexpected": "unexpected errors",
    "leftovers": "refused, but files or folders were left",
    "time-out": "time-outs",
    "died": "the process died",
}
GOOD = ("refused", "ran", "long")

PATIENCE = 60.0  # processor time that a case may take [s]
HANGING = 600.0  # as long by the clock: a busy machine is no fault of the case [s]
LONG = 5.0  # a valid run that is estimated to take longer is not run [s]
MEMORY = 8 * 2**30  # address space of a worker [bytes]


@dataclass
class Seen:
    """What was seen of one command line.

    Args:
        status: the exit status.
        errors: what was written to standard error, notes left out.
        left: files and folders that were left, if it did not end well.
        seconds: how long it took [s].
        verdict: what is already known of it, or "".
    """

    status: int = 0
    errors: str = ""
    left: list[str] = field(default_factory=list)
    seconds: float = 0.0
    verdict: str = ""


class Long(BaseException):
    """A valid run that is not done here."""


@dataclass
class _Worker:
    process: Any
    pipe: Connection
    number: int = -1
    since: float = 0.0
    before: float = 0.0

    @classmethod
    def start(cls, folder: Path) -> _Worker:
        here, there = get_context("fork").Pipe()
        process = get_context("fork").Process(target=_serve, args=(there, folder), daemon=True)
        process.start()
        there.close()
        return cls(process, here)

    def give(self, number: int, task: tuple[Sequence[str], bool]) -> None:
        self.number, self.since, self.before = number, time.monotonic(), self._processor_time()
        self.pipe.send((number, *task))

    def result(self) -> Seen | None:
        """What was seen of its case; None while it is at it."""
        seconds = time.monotonic() - self.since
        try:
            if self.pipe.poll():
                return self.pipe.recv()
        except (EOFError, OSError):
            return Seen(seconds=seconds, verdict="died")
        late = seconds > HANGING or self._processor_time() - self.before > PATIENCE
        return Seen(seconds=seconds, verdict="time-out") if late else None

    def _processor_time(self) -> float:
        """Of the process so far; 0 where it has died [s]."""
        try:
            times = psutil.Process(self.process.pid).cpu_times()
        except psutil.Error:
            return 0.0
        return times.user + times.system

    def end(self) -> None:
        self.process.kill()
        self.process.join()


def run(tasks: Sequence[tuple[Sequence[str], bool]], folder: Path, jobs: int) -> Iterator[tuple[int, Seen]]:
    """Run command lines, each in an empty folder; yield the number of each, and what was seen, when it ends.

    Args:
        tasks: command line, and whether it is a command of its own.
        folder: for theirs.
        jobs: worker processes.
    """
    _warm()
    waiting = list(enumerate(tasks))[::-1]
    workers = [_Worker.start(folder) for _ in range(min(jobs, len(tasks)))]
    for worker in workers:
        worker.give(*waiting.pop())
    while workers:
        wait([worker.pipe for worker in workers], timeout=1.0)
        for place, worker in reversed(list(enumerate(workers))):
            found = worker.result()
            if found is None:
                continue
            yield worker.number, found
            if found.verdict in ("time-out", "died"):
                worker.end()
                workers[place] = worker = _Worker.start(folder)
            if waiting:
                worker.give(*waiting.pop())
            else:
                worker.end()
                del workers[place]


def _serve(pipe: Connection, folder: Path) -> None:
    """A worker: cases in, what was seen of them out."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    while True:
        try:
            number, arguments, alone = pipe.recv()
        except EOFError:
            return
        place = folder / f"case-{number}"
        place.mkdir(parents=True)
        os.chdir(place)
        started = time.monotonic()
        seen = _alone(arguments) if alone else _here(arguments, folder / f"{number}.txt")
        seen.seconds = time.monotonic() - started
        if seen.status != 0:
            seen.left = sorted(str(path.relative_to(place)) for path in place.rglob("*"))
        os.chdir(folder)
        shutil.rmtree(place, ignore_errors=True)
        pipe.send(seen)


def _alone(arguments: Sequence[str]) -> Seen:
    """As a command of its own."""
    command = [sys.executable, "-m", "fieldrl.cli.main", *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=HANGING, check=False)
    except subprocess.TimeoutExpired:
        return Seen(verdict="time-out")
    return Seen(done.returncode, done.stderr)


def _here(arguments: Sequence[str], path: Path) -> Seen:
    """In this process."""
    from fieldrl.cli.main import main

    with _redirected(path), _without_long_runs(), without_figures():
        try:
            status, verdict = main(list(arguments)), ""
        except Long:
            status, verdict = 0, "long"
    return Seen(status, path.read_text(errors="replace"), verdict=verdict)


@contextmanager
def _redirected(path: Path):
    """Standard error into a file, standard output nowhere, also where Python's are not the process's.

    Notes are not written.
    """
    from fieldrl.cli import terminal

    kept, note = [os.dup(1), os.dup(2)], terminal.note
    with path.open("w") as file, Path(os.devnull).open("w") as nowhere:
        sys.stdout.flush()
        os.dup2(nowhere.fileno(), 1)
        os.dup2(file.fileno(), 2)
        terminal.note = lambda text: None
        try:
            with redirect_stdout(nowhere), redirect_stderr(file):
                yield
        finally:
            for number, copy in enumerate(kept, 1):
                os.dup2(copy, number)
                os.close(copy)
            terminal.note = note


@contextmanager
def _without_long_runs():
    """Runs that would take long end when everything about them has been checked."""
    from fieldrl.runs import components, limits

    seconds, check, whole = [0.0], limits.check, components.mission

    def checked(needs: Any, *others: Any) -> None:
        check(needs, *others)
        seconds[0] = sum(cost.seconds for cost in needs.values())

    def short(*arguments: Any) -> Any:
        mission = whole(*arguments)
        if seconds[0] > LONG:
            raise Long
        return mission

    limits.check, components.mission = checked, short
    try:
        yield
    finally:
        limits.check, components.mission = check, whole


@contextmanager
def without_figures():
    """The pictures of a run take longer than the run; a command of its own draws them."""
    from fieldrl import figures

    draw = figures.draw_run
    figures.draw_run = lambda record, folder: folder.mkdir()
    try:
        yield
    finally:
        figures.draw_run = draw


def _warm() -> None:
    """Import and compile before there are workers."""
    from pipelines.faults.__main__ import warm

    warm()
