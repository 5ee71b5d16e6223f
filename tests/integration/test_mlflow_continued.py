"""MLflow runs whose process was killed are continued under their own id, and nothing is logged twice."""

from __future__ import annotations

import shutil
import sqlite3
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fieldrl.app import interrupted, processes, publisher
from fieldrl.app.mlflow_view import View, connect

pytestmark = pytest.mark.filterwarnings("ignore:The ``noload`` loader:DeprecationWarning")  # MLflow's own

SERIES = {"e_total": np.array([3.0, 2.0]), "return": np.array([1.0, 5.0])}


@pytest.fixture
def folder(tmp_path) -> Path:
    """The folder of a finished run, as far as MLflow looks at it."""
    for name in ("figures", ".hydra"):
        (tmp_path / "run" / name).mkdir(parents=True)
        (tmp_path / "run" / name / "file").write_text("x")
    for name in ("record.nc", "summary.json"):
        (tmp_path / "run" / name).write_text("{}")
    return tmp_path / "run"


@pytest.fixture(scope="module")
def database(tmp_path_factory) -> Path:
    """A new database; making one takes seconds."""
    place = tmp_path_factory.mktemp("new")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        connect(None, place, "another")
    return place / "mlflow.db"


@pytest.fixture
def create(tmp_path, database):
    shutil.copy(database, tmp_path)

    def view(**changes: Any) -> View:
        settings: dict[str, Any] = {
            "uri": None,
            "output_dir": str(tmp_path),
            "experiment": "advection",
            "name": "advection-0123456789",
            "config": {"seed": 0, "parallel": {"jobs": 1}},
            "tags": {"key": "0123456789"},
            "replicates": 2,
        }
        return View.create(**settings | changes)

    return view


def query(folder: Path, text: str) -> list[tuple]:
    with sqlite3.connect(folder / "mlflow.db") as database:
        return database.execute(text).fetchall()


def statuses(folder: Path) -> list[str]:
    return sorted(status for (status,) in query(folder, "select status from runs"))


def leave(view: View, monkeypatch) -> None:
    """As if the publisher of ``view`` had been killed on the spot."""
    monkeypatch.setattr(processes, "alive", lambda tags: False)
    for run_id in {view.run_id, *view.children}:
        view.client.set_tag(run_id, "pid", "1")


@pytest.mark.parametrize("replicates", [1, 2])
def test_a_run_left_running_is_continued_and_nothing_is_logged_twice(
    create, tmp_path, folder, monkeypatch, replicates
):
    first = create(replicates=replicates)
    first.replicate(0, SERIES, {})
    leave(first, monkeypatch)
    second = create(replicates=replicates, config={"seed": 0, "parallel": {"jobs": 2}, "new": 1})
    assert second.run_id == first.run_id
    assert second.children == first.children
    for number in range(replicates):
        second.replicate(number, SERIES, {})
    second.finish(folder, {"best/e_total": 2.0}, SERIES)
    assert set(statuses(tmp_path)) == {"FINISHED"}
    runs = replicates + (replicates > 1)
    assert len(statuses(tmp_path)) == runs
    assert query(tmp_path, "select count(*) from metrics where key = 'e_total'") == [(2 * runs,)]
    assert query(tmp_path, "select value from params where key = 'new'") == [("1",)]


def test_while_it_is_continued_it_is_running_under_the_new_process(create, tmp_path, monkeypatch):
    leave(create(), monkeypatch)
    create()
    assert statuses(tmp_path) == ["RUNNING"] * 3
    found = {value for (value,) in query(tmp_path, "select value from tags where key = 'pid'")}
    assert found == {processes.identity()["pid"]}


def test_a_run_that_begins_afresh_ends_what_was_left(create, tmp_path, monkeypatch):
    first = create()
    leave(first, monkeypatch)
    assert create(afresh=True).run_id != first.run_id
    assert statuses(tmp_path) == ["KILLED"] * 3 + ["RUNNING"] * 3


def test_a_run_that_somebody_is_at_work_on_is_left_alone(create, tmp_path, monkeypatch):
    first = create()
    leave(first, monkeypatch)
    monkeypatch.setattr(processes, "alive", lambda tags: True)
    monkeypatch.setattr(interrupted, "_WINDING_UP", 0.3)
    assert create().run_id != first.run_id
    assert statuses(tmp_path) == ["RUNNING"] * 6


def test_a_finished_run_and_a_job_of_a_sweep_are_not_continued(create, tmp_path, folder, monkeypatch):
    first = create(replicates=1)
    first.finish(folder, {}, {})
    second = create(replicates=1)
    assert second.run_id != first.run_id
    second.client.set_tag(second.run_id, "job", "seed=1")
    leave(second, monkeypatch)
    assert create(replicates=1).run_id not in (first.run_id, second.run_id)


def test_a_database_that_is_locked_for_a_while_is_waited_for(create, tmp_path, monkeypatch):
    view = create(replicates=1)
    attempts = []

    def replicate() -> None:
        attempts.append(time.monotonic())
        if len(attempts) < 3:
            raise sqlite3.OperationalError("database is locked")
        view.replicate(0, SERIES, {})

    publisher.patiently(replicate)
    assert query(tmp_path, "select count(*) from metrics where key = 'return'") == [(2,)]
    monkeypatch.setattr(publisher, "_LOCKED", 0.0)
    attempts.clear()
    with pytest.raises(sqlite3.OperationalError):
        publisher.patiently(replicate)


def test_this_process_lives_and_one_that_is_gone_does_not():
    assert processes.alive(processes.identity())
    assert not processes.alive(processes.identity() | {"pid": "999999999"})
    assert not processes.alive(processes.identity() | {"started": "another time"})
    assert processes.alive(processes.identity() | {"host": "elsewhere", "pid": "999999999"})
    assert not processes.alive({})
