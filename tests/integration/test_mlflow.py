"""What MLflow shows of a run, and that nothing of MLflow's can harm one."""

from __future__ import annotations

import sqlite3
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

import fieldrl as fieldrl_package
from tests.integration.conftest import SMALL, begun, fieldrl, fieldrl_anew, summary


def query(folder: Path, text: str) -> list[tuple]:
    with sqlite3.connect(folder / "outputs" / "mlflow.db") as database:
        return database.execute(text).fetchall()


@pytest.fixture(scope="module")
def tracked(tmp_path_factory) -> Path:
    """The folder of a small tracked run with two replicates."""
    folder = tmp_path_factory.mktemp("tracked")
    stale = {"MLFLOW_RUN_ID": "0" * 32, "MLFLOW_EXPERIMENT_NAME": "elsewhere"}
    finished = fieldrl_anew(folder, *SMALL, "parallel=serial", **stale)
    assert finished.returncode == 0, finished.stderr
    assert finished.stderr == ""
    assert "MLflow" in finished.stdout
    return folder


def test_a_run_has_a_parent_and_a_child_for_each_replicate(tracked):
    runs = query(tracked, "select run_uuid, name, status from runs")
    (name,) = [found for _, found, _ in runs if not found.startswith("replicate")]
    assert name.startswith("advection ")
    assert {found for _, found, _ in runs} == {name, *(f"replicate {i} of {name}" for i in range(2))}
    assert {status for *_, status in runs} == {"FINISHED"}
    (parent,) = [run for run, found, _ in runs if found == name]
    nested = query(tracked, "select value from tags where key = 'mlflow.parentRunId'")
    assert nested == [(parent,), (parent,)]


def test_every_episode_of_every_replicate_has_its_metrics(tracked):
    steps = query(tracked, "select key, count(distinct step), count(*) from metrics group by key")
    counts = {key: (distinct, rows) for key, distinct, rows in steps}
    for key in ("return", "e_f", "e_cv", "e_total", "theta_error", "mean_e_total", "forward_solves"):
        assert counts[f"learning/{key}"] == (3, 9)
    for key in ("estimate/b_x", "estimate/b_y", "error/b_x", "error/b_y"):
        assert counts[key] == (3, 9)
    for key in ("e_total", "greedy/return", "pooled/b_x", "best/b_y"):
        assert counts[key] == (1, 1)


def test_metrics_agree_with_the_summary(tracked):
    (value,) = query(tracked, "select value from latest_metrics where key = 'theta_error'")[0]
    assert value == summary(tracked)["theta_error"]


def test_every_value_of_the_configuration_is_a_parameter(tracked):
    params = dict(query(tracked, "select key, value from params"))
    assert params["episodes"] == "3"
    assert params["agent.tile_coding.tilings"] == "8"
    assert params["vehicle.start"] == "[20, 20]"
    assert params["vehicle.sensor.noise"] == "1"
    assert params["agent"] == "sarsa_lambda"
    assert params["pde.initial"] == "InitialFeature"
    assert not {"output_dir", "tracking", "parallel"} & params.keys()


def test_a_run_and_its_experiment_explain_themselves(tracked):
    (note,) = [text for (text,) in query(tracked, "select value from tags where key = 'mlflow.note.content'")]
    assert "All 60 samples" in note or "samples of the first replicate" in note
    assert "fieldrl experiment=advection" in note
    about = dict(query(tracked, "select key, value from experiment_tags"))
    assert "plume" in about["mlflow.note.content"]
    assert "pooled/b_x" in about["mlflow.sharedViewState.fieldrl"]


def test_the_parent_is_tagged_with_key_version_and_status(tracked):
    tags = set(query(tracked, "select key, value from tags"))
    assert {("key", summary(tracked)["key"]), ("status", "finished")} <= tags
    keys = {key for key, _ in tags}
    assert {"version", "mlflow.source.name"} <= keys
    assert "git_commit" in keys or not (Path(fieldrl_package.__file__).parents[1] / ".git").exists()


def test_record_summary_and_figures_are_artifacts_of_the_parent(tracked):
    ((place,),) = query(
        tracked, "select distinct artifact_location from experiments where name = 'advection'"
    )
    assert place == (tracked / "outputs" / "mlartifacts" / "advection").as_uri()
    names = {path.name for path in (tracked / "outputs" / "mlartifacts").rglob("*") if path.is_file()}
    assert {
        "report.html",
        "record.nc",
        "summary.json",
        "path.png",
        "learning_curve.png",
        "config.yaml",
    } <= names
    assert not (tracked / "mlruns").exists()


def test_a_run_that_was_computed_untracked_is_published_when_it_is_asked_for_again(tmp_path):
    fieldrl(tmp_path, *SMALL, "replicates=1", "tracking=none")
    assert not (tmp_path / "outputs" / "mlflow.db").exists()
    for _ in range(2):  # and only once
        finished = fieldrl(tmp_path, *SMALL, "replicates=1")
        assert "finished before" in finished.stdout
    assert query(tmp_path, "select status from runs") == [("FINISHED",)]
    assert query(tmp_path, "select count(*) from metrics where key = 'learning/e_total'") == [(3,)]


def test_without_mlflow_the_run_finishes_and_says_so_in_one_line(tmp_path):
    finished = fieldrl(
        tmp_path, *SMALL, "replicates=1", "tracking.uri=http://127.0.0.1:9", "tracking.patience=90"
    )
    assert finished.returncode == 0, finished.stderr
    assert summary(tmp_path)["finished"] is True
    (line,) = [line for line in finished.stdout.splitlines() if "MLflow did not take this run" in line]
    assert "complete on disk" in line


def test_a_broken_database_does_not_harm_the_run(tmp_path):
    (tmp_path / "outputs").mkdir()
    (tmp_path / "outputs" / "mlflow.db").write_text("this is no database " * 100)
    finished = fieldrl(tmp_path, *SMALL, "replicates=1")
    assert finished.returncode == 0, finished.stderr
    assert "MLflow did not take this run" in finished.stdout
    assert summary(tmp_path)["finished"] is True


def test_first_use_by_three_processes_at_once_loses_nothing(tmp_path):
    with ExitStack() as stack:
        each = [
            stack.enter_context(begun(tmp_path, *SMALL, "replicates=1", f"seed={seed}")) for seed in range(3)
        ]
        outputs = [process.wait().stdout for process in each]
    assert [line for output in outputs for line in output.splitlines() if "did not take" in line] == []
    assert query(tmp_path, "select count(*) from runs where status = 'FINISHED'") == [(3,)]
    assert query(tmp_path, "select count(*) from experiments where name = 'advection'") == [(1,)]


def test_a_killed_run_does_not_stay_running_in_mlflow(tmp_path):
    with begun(tmp_path, "experiment=advection", "episodes=100000", "replicates=1") as process:
        _wait_until(lambda: _statuses(tmp_path) == ["RUNNING"])
        process.kill()
        _wait_until(lambda: _statuses(tmp_path) == ["KILLED"])


def _statuses(folder: Path) -> list[str]:
    try:
        return [status for (status,) in query(folder, "select status from runs")]
    except sqlite3.OperationalError:
        return []


def _wait_until(holds, seconds: float = 90.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.2)
