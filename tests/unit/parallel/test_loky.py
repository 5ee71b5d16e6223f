"""Workers: how many, and in which process."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from contextlib import closing
from functools import partial

import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.parallel import loky
from fieldrl.parallel.loky import Loky, Pool
from fieldrl.parallel.serial import Serial


def test_there_is_a_worker_for_each_core_unless_it_is_said_how_many(monkeypatch):
    monkeypatch.setattr(loky, "cores", lambda: 8)
    assert (Loky().size, Loky(2).size) == (8, 2)


def test_within_a_worker_of_a_sweep_there_is_one():
    with closing(Pool(1)) as pool:
        assert dict(pool.run({0: partial(getattr, Loky(8), "size")}, "task")) == {0: 1}


@pytest.mark.parametrize("workers", [Serial(), Loky(1), Loky(8)])
def test_one_job_or_one_worker_stays_in_this_process(workers):
    tasks = {0: os.getpid} if workers == Loky(8) else {0: os.getpid, 1: os.getpid}
    assert list(workers.run(tasks, "task")) == [(number, os.getpid()) for number in tasks]


def test_what_a_task_raises_is_raised_and_the_others_are_given_up(tmp_path):
    workers = Loky(2)
    tasks = {0: partial(int, "x"), 1: partial(time.sleep, 600), 2: partial((tmp_path / "done").touch)}
    started = time.monotonic()
    with pytest.raises(ValueError, match="invalid literal"):
        list(workers.run(tasks, "task"))
    assert time.monotonic() - started < 60
    assert dict(workers.run({0: os.getppid, 1: os.getppid}, "task")) == {0: os.getpid(), 1: os.getpid()}
    workers.close()


def test_a_pool_is_closed_at_once_after_a_task_was_given_to_a_warm_worker(monkeypatch):
    failures = []
    monkeypatch.setattr(threading, "excepthook", failures.append)
    for _ in range(5):
        with closing(Pool(2)) as pool:
            list(pool.run({0: os.getpid, 1: os.getpid}, "task"))
            tasks = {0: partial(time.sleep, 600), 1: os.getpid}
            with pytest.raises(ZeroDivisionError):
                list(pool.run(tasks, "task", begun=lambda number: 1 / (1 - number)))
    assert failures == []


@pytest.mark.parametrize("jobs", [0, -2, 1.5, "two", True])
def test_an_impossible_number_of_workers_is_refused(jobs):
    with pytest.raises(InvalidValue, match="jobs="):
        Loky(jobs)


@pytest.mark.parametrize("moment", [0.4, 0.7, 1.0, 1.5])
def test_no_worker_outlives_a_process_that_is_killed(moment):
    code = (
        "import time; from functools import partial; from fieldrl.parallel.loky import Loky\n"
        "list(Loky(2).run(dict.fromkeys((0, 1), partial(time.sleep, 60)), 'task'))"
    )
    process = subprocess.Popen([sys.executable, "-c", code], start_new_session=True)
    time.sleep(moment)
    process.kill()
    process.wait()
    end = time.monotonic() + 20
    while _any_left(process.pid):
        assert time.monotonic() < end
        time.sleep(0.1)


def _any_left(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
