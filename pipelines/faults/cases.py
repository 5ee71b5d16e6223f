"""What may happen to a run: each case breaks something, asks again, and compares with an unbroken run."""

from __future__ import annotations

import os
import shutil
import signal
import sqlite3
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.faults import victims
from pipelines.faults.bench import Bench, Outcome, results, same
from pipelines.faults.victims import Victim

_SMALL = ("experiment=advection", "episodes=30", "steps=5", "evaluation_episodes=2", "replicates=2")
_QUIET = ("tracking=none", "parallel=serial")
ADVECTION = (*_SMALL, *_QUIET)
GYRE = (
    "experiment=double_gyre", "pde.cells=[48,24]", "episodes=3", "steps=4", "evaluation_episodes=1",
    "replicates=2", *_QUIET,
)  # fmt: skip
CHANCE = (*_SMALL, *_QUIET, "agent=random", "vehicle.sensor.covariance=[1,1,0.01]")
GAUSSIAN = (
    *_SMALL, *_QUIET, "estimator=gaussian_process", "estimator.share=true", "estimator.budget=4",
    "estimator.initial=3", "episodes=3", "steps=1", "evaluation_episodes=1", "replicates=1",
)  # fmt: skip
WORKERS = (*_SMALL, "tracking=none", "parallel.jobs=2")
SLOW = (*WORKERS, "episodes=6", "pde._target_=pipelines.faults.victims.Slow")
SLOW_SWEEP = (
    "-m", *SLOW, "replicates=1", "seed=0,1,2", "hydra/launcher=joblib",
    "hydra.launcher.n_jobs=2",
)  # fmt: skip
TRACKED = (*_SMALL, "parallel=serial")
UNRELIABLE = (*GYRE, "episodes=2", "pde._target_=pipelines.faults.victims.Unreliable")
SWEEP = ("-m", *_SMALL, *_QUIET, "episodes=10", "seed=0,1,2")
SINGLE = (ADVECTION, GYRE, CHANCE, WORKERS, GAUSSIAN)
"""What is killed: every agent that has chance, every estimator, one process and several."""


def kills(bench: Bench, count: int, commands: Sequence[Sequence[str]] = SINGLE) -> Outcome:
    """SIGKILL at random moments, every other time to the process alone; then the same command."""
    outcome = Outcome()
    for turn in range(count):
        arguments = commands[turn % len(commands)]
        place, moment = bench.place(), bench.moment(arguments)
        victim = victims.start(place, arguments)
        time.sleep(moment)
        before = set(place.glob("outputs/runs/*/summary.json"))
        victim.kill(workers=turn % 2 == 0)
        victim.wait()
        outcome.lost += len(before - set(place.glob("outputs/runs/*/summary.json")))
        bench.again(place, arguments, outcome)
    return outcome


def writing(bench: Bench, count: int) -> Outcome:
    """SIGKILL at the moment of writing a checkpoint, a record, figures or a summary."""
    outcome = Outcome()
    names = ("replicate-", "replicate-", "record.nc", "replicate-", "figures", "summary.json")
    for turn in range(count):
        moment = ("half", "before", "after")[turn % 3]
        arguments, place = (ADVECTION, GYRE)[turn // 3 % 2], bench.place()
        name = names[turn // 3 % len(names)]
        nth = int(bench.rng.integers(1, 8)) if name == "replicate-" else 0
        fault = partial(victims.killed_while_writing, name, moment, nth)
        status, *_ = victims.run(place, arguments, fault)
        outcome.expect(status == -signal.SIGKILL, f"{name} {moment}: was not killed but ended with {status}")
        bench.again(place, arguments, outcome)
    return outcome


def interrupts(bench: Bench, count: int) -> Outcome:
    """Ctrl-C: one line, exit status 130, and the same command continues."""
    outcome = Outcome()
    for turn in range(count):
        arguments, place = (WORKERS, ADVECTION)[turn % 2], bench.place()
        victim = victims.start(place, arguments, partial(victims.slow_episodes, 0.03))
        _wait_for(lambda folder=place: list(folder.glob("outputs/runs/*/checkpoints/replicate-1")))
        victim.interrupt()
        status, _, errors = victim.wait()
        outcome.saw(errors)
        outcome.expect(status == 130 and len(errors.split("\n")) == 3, f"{status}: {errors}")
        bench.again(place, arguments, outcome)
    return outcome


def dead_worker(bench: Bench, count: int, arguments: Sequence[str] = SLOW, times: int = 1) -> Outcome:
    """A worker process is killed; with ``times`` 2 so is one of those that take its place."""
    outcome = Outcome()
    for _ in range(count):
        place, dead = bench.place(), set()
        victim = victims.start(place, arguments)
        _wait_for(lambda folder=place: list(folder.glob("outputs/runs/*/checkpoints/replicate-*")))
        for _ in range(times):
            _wait_for(lambda found=victim, known=dead: set(found.workers()) - known)
            dead |= set(workers := victim.workers())
            os.kill(workers[-1], signal.SIGKILL)
            time.sleep(1.0)
        status, _, errors = victim.wait()
        outcome.saw(errors)
        outcome.expect(status == (times > 1), f"{status}: {errors}")
        bench.again(place, arguments, outcome)
    return outcome


def first_use(bench: Bench, count: int, processes: int = 8) -> Outcome:
    """Processes started at once where nothing is yet: no error, one experiment, every run and metric."""
    outcome = Outcome()
    for _ in range(count):
        place = bench.place()
        commands = [(*TRACKED, "episodes=3", "replicates=1", f"seed={seed}") for seed in range(processes)]
        started = [
            _elsewhere(victims.start, place, number, command) for number, command in enumerate(commands)
        ]
        ended = [victim.wait() for victim in started]
        for status, output, errors in ended:
            outcome.saw(errors)
            outcome.expect(status == 0 and "did not take" not in output, f"{status}: {output} {errors}")
        outcome.compare(_tracked(place) == (1, processes, 3 * processes), f"MLflow: {_tracked(place)}")
        shutil.rmtree(place, ignore_errors=True)
    return outcome


def same_run(bench: Bench, count: int) -> Outcome:
    """Two processes are asked for the same run: one computes, the other says who does, and waits."""
    outcome = Outcome()
    for _ in range(count):
        place = bench.place()
        slow = partial(victims.slow_episodes, 0.03)
        first = _elsewhere(victims.start, place, 0, ADVECTION, slow)
        _wait_for(lambda folder=place: list(folder.glob("outputs/runs/*/checkpoints/replicate-0")))
        second = _elsewhere(victims.start, place, 1, ADVECTION, slow)
        texts = [victim.wait()[1] for victim in (first, second)]
        waited = f"is being computed by another process (process {first.pid} on" in texts[1]
        outcome.expect(waited and "finished before" in texts[1], texts[1])
        outcome.compare(same(results(place), bench.reference(ADVECTION)), "another result")
        outcome.saw(next((line for line in texts[1].splitlines() if "being computed" in line), ""))
    return outcome


def locked_database(bench: Bench, count: int, seconds: float = 30.0) -> Outcome:
    """Another process keeps the database locked while a run is published."""
    outcome = Outcome()
    for _ in range(count):
        place = bench.place()
        _first, *_ = victims.run(place, (*TRACKED, "seed=1"))
        with sqlite3.connect(place / "outputs" / "mlflow.db", isolation_level=None) as database:
            database.execute("begin exclusive")
            victim = victims.start(place, TRACKED)
            time.sleep(seconds)
            database.execute("commit")
        status, output, errors = victim.wait()
        outcome.saw(errors)
        tracked = _tracked(place)[1] == 2 * 3  # parents and replicates
        outcome.compare(
            status == 0 and tracked and "did not take" not in output, f"{status} {output} {errors}"
        )
    return outcome


def disk(bench: Bench, count: int, ending: str) -> Outcome:
    """A disk that becomes full, or can only be read; then there is room again."""
    outcome = Outcome()
    for _ in range(count):
        place = bench.place()
        with _small_disk(place / "outputs") as real:
            fault = None if real else victims.full_disk
            if real and ending == "read-only":
                _remount(place / "outputs", "ro")
            status, _, errors = victims.run(place, ADVECTION, fault)
            outcome.saw(errors)
            outcome.expect(status == 1, f"{status}: {errors}")
            if real:
                _remount(place / "outputs", "rw,size=64m")
            bench.again(place, ADVECTION, outcome)
    return outcome


def no_number(bench: Bench, count: int) -> Outcome:
    """A solver that fails for a quarter of all parameters, killed in the middle too."""
    outcome = kills(bench, count, [UNRELIABLE])
    for record, _ in bench.reference(UNRELIABLE).values():
        lost = float(np.isnan(record["trace_loss"].values).mean())
        outcome.expect(bool(np.isfinite(record["e_total"].values).all()) and lost > 0, "no estimate")
    return outcome


def garbled(bench: Bench, count: int, what: str) -> Outcome:
    """A file is truncated, or bytes in the middle of it are other ones; then the same command."""
    outcome = Outcome()
    for turn in range(count):
        arguments, place = GYRE if what == "solves" else ADVECTION, bench.place()
        if what in ("replicate", "solves"):
            last = partial(victims.killed_while_writing, "record.nc", "half", 0)
            victims.run(place, arguments, last)
        else:
            victims.run(place, arguments)
        paths = [path for path in place.glob("outputs/runs/*/**/*") if what in str(path) and path.is_file()]
        for path in sorted(paths)[:: 2 if what == "replicate" else 1]:
            content = path.read_bytes()
            half = len(content) // 2
            path.write_bytes(content[:half] + (b"" if turn % 2 else b"#" * 64 + content[half + 64 :]))
        bench.again(place, arguments, outcome)
    return outcome


def _elsewhere(
    start: Callable[..., Victim], place: Path, number: int, arguments: Sequence[str], *fault: Any
) -> Victim:
    """Start a command in a folder of its own, with its output in ``place``."""
    return start(place / f"user-{number}", (*arguments, f"output_dir={place / 'outputs'}"), *fault)


def _tracked(place: Path) -> tuple[int, int, int]:
    """Experiments, finished runs and values of the episodes' e_total in the database."""
    queries = (
        "select count(*) from experiments where name = 'advection'",
        "select count(*) from runs where status = 'FINISHED'",
        "select count(*) from metrics where key = 'learning/e_total'",
    )
    with sqlite3.connect(place / "outputs" / "mlflow.db") as database:
        found = [database.execute(query).fetchone()[0] for query in queries]
    return found[0], found[1], found[2]


@contextmanager
def _small_disk(place: Path) -> Iterator[bool]:
    """A file system with little room; false where this user may not make one."""
    place.mkdir(parents=True)
    command = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(place)]
    real = subprocess.run(command, capture_output=True, check=False).returncode == 0
    try:
        yield real
    finally:
        if real:
            subprocess.run(["umount", str(place)], check=False)


def _remount(place: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", str(place)], check=True)


def _wait_for(holds: Callable[[], Any], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError("waited in vain")
        time.sleep(0.02)
