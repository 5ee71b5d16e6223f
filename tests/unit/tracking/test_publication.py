"""Runs in MLflow: what was interrupted continues under its own id, and nothing is logged twice."""

from __future__ import annotations

import shutil
import sqlite3
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier
from typing import Any

import numpy as np
import pytest
from filelock import FileLock

from fieldrl.tracking import publication as module
from fieldrl.tracking import publisher
from fieldrl.tracking.database import Database
from fieldrl.tracking.publication import Publication

pytestmark = pytest.mark.filterwarnings("ignore:The ``noload`` loader:DeprecationWarning")  # MLflow's own

SERIES = {"e_total": np.array([3.0, 2.0]), "return": np.array([1.0, 5.0])}
SUMMARY = """{"best_episode": 0, "episodes": 2, "steps": 1, "replicates": 1, "e_f": 1,
              "e_cv": 1, "e_total": 2, "theta_error": 0, "field_rmse": null, "parameters": {},
              "pooled": {"parameters": {}}, "late_e_total": [2.0], "forward_solves": 1, "converged": 1,
              "seconds": 1}"""


@pytest.fixture(scope="module")
def database(tmp_path_factory) -> Path:
    """A new database; making one takes seconds."""
    place = tmp_path_factory.mktemp("new")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        Database(None, place).experiment("another")
    return place / "mlflow.db"


@pytest.fixture
def opened(tmp_path, database):
    """As a new publishing process; the one before has been killed on the spot."""
    shutil.copy(database, tmp_path)
    before: list[Publication] = []

    def publication(**changes: Any) -> Publication:
        if before and before[-1].lock is not None:
            before[-1].lock.release()
        settings: dict[str, Any] = {"uri": None, "output_dir": str(tmp_path), "experiment": "advection"}
        before.append(Publication(**settings | changes))
        return before[-1]

    return publication


@pytest.fixture
def told(tmp_path):
    """What is told of a finished run, as far as MLflow looks at it."""
    folder = tmp_path / "run"
    for name in ("figures", ".hydra"):
        (folder / name).mkdir(parents=True)
        (folder / name / "file").write_text("x")
    (folder / "record.nc").write_text("{}")
    (folder / "summary.json").write_text(SUMMARY)

    def run(**changes: Any) -> dict[str, Any]:
        known = {
            "label": "",
            "experiment": "advection",
            "name": "advection",
            "key": "0123456789",
            "command": "",
        }
        known |= {"folder": str(folder), "config": {"seed": 0, "parallel": {"jobs": 1}}}
        return known | {"replicates": 2, "afresh": False} | changes

    return run


def query(folder: Path, text: str) -> list[tuple]:
    with sqlite3.connect(folder / "mlflow.db") as database:
        return database.execute(text).fetchall()


def statuses(folder: Path) -> list[str]:
    return sorted(status for (status,) in query(folder, "select status from runs"))


@pytest.mark.parametrize("replicates", [1, 2])
def test_a_run_left_running_is_continued_and_nothing_is_logged_twice(opened, told, tmp_path, replicates):
    first, run = opened(), told(replicates=replicates)
    run_id = first.begin(run).run_id
    first.replicate(run, 0, SERIES)
    second, again = opened(), told(replicates=replicates, config={"seed": 0, "new": 1})
    assert second.begin(again).run_id == run_id
    for number in range(replicates):
        second.replicate(again, number, SERIES)
    second.done(again)
    assert set(statuses(tmp_path)) == {"FINISHED"}
    runs = replicates + (replicates > 1)
    assert len(statuses(tmp_path)) == runs
    assert query(tmp_path, "select count(*) from metrics where key = 'e_total'") == [(2 * runs,)]
    assert query(tmp_path, "select value from params where key = 'new'") == [("1",)]


def test_a_run_that_is_begun_twice_by_one_process_is_one_run(opened, told, tmp_path):
    publication = opened()
    assert publication.begin(told()).run_id == publication.begin(told()).run_id
    assert statuses(tmp_path) == ["RUNNING"]


def test_a_run_that_begins_afresh_ends_what_was_left(opened, told, tmp_path):
    first = opened().begin(told())
    assert opened().begin(told(afresh=True)).run_id != first.run_id
    assert statuses(tmp_path) == ["KILLED", "RUNNING"]


def test_a_run_that_somebody_is_at_work_on_is_left_alone(opened, told, tmp_path, monkeypatch):
    first = opened().begin(told())
    second = opened()
    monkeypatch.setattr(module, "_WINDING_UP", 0.3)
    with FileLock(tmp_path / ".locks" / "advection-0123456789.mlflow.lock"):
        assert second.begin(told()).run_id != first.run_id
    assert statuses(tmp_path) == ["RUNNING"] * 2


def test_a_run_of_another_folder_that_is_running_is_left_alone(opened, told, tmp_path):
    first = opened().begin(told(folder="/elsewhere/run"))
    assert opened().begin(told()).run_id != first.run_id
    assert statuses(tmp_path) == ["RUNNING"] * 2


def test_a_finished_run_and_a_job_of_a_sweep_are_not_continued(opened, told, tmp_path):
    first = opened()
    first.replicate(told(replicates=1), 0, SERIES)  # not begun: nobody listens
    finished = first.begin(told(replicates=1))
    first.replicate(told(replicates=1), 0, SERIES)
    first.done(told(replicates=1))
    second = opened()
    job = second.begin(told(replicates=1))
    assert job.run_id != finished.run_id
    second.client.set_tag(job.run_id, "job", "seed=1")
    assert opened().begin(told(replicates=1)).run_id not in (finished.run_id, job.run_id)


def test_what_is_given_up_is_failed_and_the_rest_is_killed_at_the_end(opened, told, tmp_path):
    sweep = {"title": "advection sweep", "key": "1", "arguments": ["seed=0,1"]}
    publication = opened(sweep=sweep)
    for label in ("seed=0", "seed=1"):
        publication.begin(told(label=label))
    publication.give_up(told(label="seed=0"))
    publication.end("KILLED")
    assert statuses(tmp_path) == ["FAILED", "KILLED", "KILLED"]


def test_every_job_of_a_sweep_is_in_its_own_experiment_and_is_found_there_again(opened, told, tmp_path):
    sweep = {"title": "advection sweep", "key": "1", "arguments": ["experiment=advection,double_gyre"]}
    jobs = [
        told(label=f"experiment={name}", experiment=name, key=name) for name in ("advection", "double_gyre")
    ]
    first = opened(sweep=sweep)
    ids = [first.begin(job).run_id for job in jobs]
    text = "select e.name from runs r join experiments e using (experiment_id) where r.run_uuid = '{}'"
    found = [query(tmp_path, text.format(run_id)) for run_id in (first.parent, *ids)]
    assert found == [[("advection",)], [("advection",)], [("double_gyre",)]]
    second = opened(sweep=sweep)
    assert second.parent == first.parent
    assert [second.begin(job).run_id for job in jobs] == ids


def test_processes_that_describe_an_experiment_at_once_do_not_disturb_each_other(tmp_path, database):
    shutil.copy(database, tmp_path)
    writers, start = [Database(None, tmp_path) for _ in range(3)], Barrier(3, timeout=60)

    def describe(writer: Database) -> None:
        for round_ in range(10):
            writer.experiment(f"experiment {round_}")
            start.wait()
            writer.describe(f"experiment {round_}", {"first": "1", "second": "2"})

    with ThreadPoolExecutor(3) as pool:
        list(pool.map(describe, writers))
    tags = writers[0].client.get_experiment_by_name("experiment 9").tags
    assert {"first": "1", "second": "2"}.items() <= tags.items()


def test_a_database_that_is_locked_for_a_while_is_waited_for(opened, told, tmp_path, monkeypatch):
    publication, run = opened(), told(replicates=1)
    publication.begin(run)
    attempts = []

    def replicate() -> None:
        attempts.append(time.monotonic())
        if len(attempts) < 3:
            raise sqlite3.OperationalError("database is locked")
        publication.replicate(run, 0, SERIES)

    publisher.patiently(replicate)
    assert query(tmp_path, "select count(*) from metrics where key = 'return'") == [(2,)]
    monkeypatch.setattr(publisher, "_LOCKED", 0.0)
    attempts.clear()
    with pytest.raises(sqlite3.OperationalError):
        publisher.patiently(replicate)
