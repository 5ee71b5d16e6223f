"""A sweep in MLflow: a parent, a child for each job, grandchildren for replicates."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from tests.integration.conftest import fieldrl

TINY = ("experiment=advection", "episodes=2", "steps=3", "evaluation_episodes=1", "parallel=serial")
SWEEP = ("-m", *TINY, "replicates=2", "agent.step_size=0.5,-1")


def query(folder: Path, text: str) -> list[tuple]:
    with sqlite3.connect(folder / "outputs" / "mlflow.db") as database:
        return database.execute(text).fetchall()


def tags(folder: Path, run: str) -> dict[str, str]:
    return dict(query(folder, f"select key, value from tags where run_uuid = '{run}'"))


def tree(folder: Path, parent: str = "") -> dict[str, tuple[str, dict]]:
    """Name: (status, its children) of every run below ``parent``."""
    runs = query(folder, "select run_uuid, name, status from runs")
    found = [(run, name, status) for run, name, status in runs if _parent(folder, run) == parent]
    return {name: (status, tree(folder, run)) for run, name, status in found}


def _parent(folder: Path, run: str) -> str:
    return tags(folder, run).get("mlflow.parentRunId", "")


@pytest.fixture(scope="module")
def swept(tmp_path_factory) -> Path:
    """The folder of a sweep with a job that fails, run twice: the second time changes nothing."""
    folder = tmp_path_factory.mktemp("swept")
    for _ in range(2):
        finished = fieldrl(folder, *SWEEP)
        assert finished.returncode == 1, finished.stderr
        assert "MLflow did not" not in finished.stdout
    return folder


def test_there_is_a_parent_a_child_for_each_job_and_one_for_each_replicate(swept):
    ((name, (status, jobs)),) = tree(swept).items()
    assert name.startswith("advection-sweep-")
    assert status == "FAILED"
    assert sorted(status for status, _ in jobs.values()) == ["FAILED", "FINISHED"]
    ((good, replicates),) = [(name, below) for name, (status, below) in jobs.items() if below]
    assert replicates == {f"{good} replicate {i}": ("FINISHED", {}) for i in range(2)}


def test_a_failed_job_carries_its_reason(swept):
    reasons = query(swept, "select value from tags where key = 'reason'")
    assert reasons == [("agent.step_size=-1: must lie in (0, 1]",)]


def test_the_parent_has_the_overrides_the_best_job_and_the_table(swept):
    ((parent,),) = query(swept, "select run_uuid from runs where name like '%-sweep-%'")
    found = tags(swept, parent)
    (summary,) = (swept / "outputs" / "runs").glob("*/summary.json")
    assert found["best"] == summary.parent.name.rpartition("-")[2]
    assert "agent.step_size=0.5,-1" in found["overrides"]
    params = dict(query(swept, f"select key, value from params where run_uuid = '{parent}'"))
    assert params["agent.step_size"] == "0.5,-1"
    artifacts = swept / "outputs" / "mlartifacts" / "advection" / parent / "artifacts"
    names = {str(path.relative_to(artifacts)) for path in artifacts.rglob("*") if path.is_file()}
    assert {"results.csv", "figures/results.png"} <= names


def test_a_run_that_was_tracked_on_its_own_becomes_a_child_of_the_sweep(tmp_path):
    for arguments in ((), ("-m",), ("-m",)):
        finished = fieldrl(tmp_path, *arguments, *TINY, "replicates=1", "seed=0")
        assert finished.returncode == 0, finished.stderr
    ((_, (status, jobs)),) = tree(tmp_path).items()
    assert status == "FINISHED"
    assert [status for status, _ in jobs.values()] == ["FINISHED"]


def test_two_sweeps_that_share_a_run_both_have_it(tmp_path):
    for seeds in ("0,1", "1,2"):
        finished = fieldrl(tmp_path, "-m", *TINY, "replicates=1", f"seed={seeds}")
        assert finished.returncode == 0, finished.stderr
    sweeps = tree(tmp_path)
    assert [len(jobs) for _, jobs in sweeps.values()] == [2, 2]
    first, second = (set(jobs) for _, jobs in sweeps.values())
    assert len(first & second) == 1
