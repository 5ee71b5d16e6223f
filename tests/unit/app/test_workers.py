"""Workers: how many, and in which process."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from fieldrl.app import parallel
from fieldrl.app.parallel import Workers
from fieldrl.core.checks import InvalidValue


def test_there_are_never_more_workers_than_tasks(monkeypatch):
    monkeypatch.setattr(parallel, "cores", lambda: 8)
    assert [Workers().count(tasks) for tasks in (1, 3, 20)] == [1, 3, 8]
    assert Workers(2).count(20) == 2


def test_one_job_stays_in_this_process():
    assert list(Workers(1).run(lambda number: (number, os.getpid()), [0, 1])) == [
        (0, (0, os.getpid())),
        (1, (1, os.getpid())),
    ]


@pytest.mark.parametrize("jobs", [0, -2, 1.5, "two", True])
def test_an_impossible_number_of_workers_is_refused(jobs):
    with pytest.raises(InvalidValue, match="jobs="):
        Workers(jobs)


@pytest.mark.parametrize("moment", [0.4, 0.7, 1.0, 1.5])
def test_no_worker_outlives_a_process_that_is_killed(moment):
    code = "import time; from fieldrl.app.parallel import Workers; list(Workers(2).run(time.sleep, [60, 60]))"
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
