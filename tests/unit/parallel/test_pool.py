"""Worker processes: one that dies costs its own job alone, which is tried once more."""

from __future__ import annotations

import os
import signal
import time
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import psutil
import pytest

from fieldrl.parallel import loky
from fieldrl.parallel.loky import Pool
from fieldrl.parallel.serial import Serial
from fieldrl.parallel.workers import WorkerKilled


@dataclass(frozen=True)
class Stub:
    """Stands in for a task: tells its process, and kills it as often as asked."""

    number: int
    folder: str
    kills: int = 0

    def __call__(self) -> dict[str, int]:
        marks = Path(self.folder)
        (marks / f"{self.number}-{len(list(marks.glob(f'{self.number}-*')))}").touch()
        if len(list(marks.glob(f"{self.number}-*"))) <= self.kills:
            os.kill(os.getpid(), signal.SIGKILL)
        return {"number": self.number, "pid": os.getpid()}


@pytest.fixture
def pool():
    made = Pool(2)
    yield made
    made.close()


def attempts(folder: Path) -> dict[str, int]:
    numbers = [path.name.partition("-")[0] for path in folder.iterdir()]
    return {number: numbers.count(number) for number in sorted(numbers)}


def test_every_task_is_done_once_by_workers_that_stay(pool, tmp_path):
    tasks = {i: Stub(i, str(tmp_path)) for i in range(6)}
    begun: list[int] = []
    outcomes = dict(pool.run(tasks, "job", begun.append))
    assert {number: outcome["number"] for number, outcome in outcomes.items()} == {i: i for i in tasks}
    assert sorted(begun) == list(tasks)
    pids = {outcome["pid"] for outcome in outcomes.values()}
    assert len(pids) <= 2
    assert os.getpid() not in pids


def test_a_killed_worker_costs_its_job_alone_and_that_is_tried_once_more(pool, tmp_path):
    tasks = {i: Stub(i, str(tmp_path), kills=1 if i == 1 else 0) for i in range(4)}
    with pytest.warns(UserWarning, match="job 1: its worker was killed .* tried once more"):
        outcomes = dict(pool.run(tasks, "job"))
    assert not any(isinstance(outcome, WorkerKilled) for outcome in outcomes.values())
    assert attempts(tmp_path) == {"0": 1, "1": 2, "2": 1, "3": 1}


def test_a_job_whose_worker_is_killed_twice_has_failed_and_the_others_are_done(pool, tmp_path):
    tasks = {i: Stub(i, str(tmp_path), kills=9 if i == 0 else 0) for i in range(3)}
    with pytest.warns(UserWarning, match="job 0"):
        outcomes = dict(pool.run(tasks, "job"))
    assert str(outcomes[0]) == "job 0: its worker was killed twice (out of memory?)"
    assert attempts(tmp_path) == {"0": 2, "1": 1, "2": 1}


def test_without_workers_everything_is_done_here_in_order(tmp_path):
    tasks = {i: Stub(i, str(tmp_path)) for i in (3, 1)}
    outcomes = list(Serial().run(tasks, "job"))
    assert [number for number, _ in outcomes] == [3, 1]
    assert {outcome["pid"] for _, outcome in outcomes} == {os.getpid()}


def test_an_interrupt_while_a_worker_is_started_leaves_none_behind(monkeypatch):
    begun, before = [], set(psutil.Process().children(recursive=True))  # idle pools of other tests

    @contextmanager
    def interrupted_the_second_time():
        yield
        begun.append(set(psutil.Process().children(recursive=True)) - before)
        if len(begun) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(loky, "uninterrupted", interrupted_the_second_time)
    tasks = dict.fromkeys(range(3), partial(time.sleep, 600))
    with pytest.raises(KeyboardInterrupt):
        list(Pool(2).run(tasks, "task"))
    left = [process for process in begun[1] if process.is_running() and "LokyProcess" in _command(process)]
    assert len(begun) == 2
    assert not left


def _command(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.Error:
        return ""
