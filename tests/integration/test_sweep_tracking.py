"""A sweep in MLflow: a parent, a child for each job, grandchildren for replicates."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
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


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_its_job_alone_and_mlflow_shows_every_job_once(tmp_path):
    command = [sys.executable, "-m", "fieldrl.app.main", "-m", *TINY[:1], "evaluation_episodes=0"]
    jobs = ["replicates=1", "episodes=60", "seed=0,1", "hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]
    sweep = subprocess.Popen([*command, *jobs], cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    os.kill(_holder(tmp_path / "outputs" / ".locks"), signal.SIGKILL)
    output, _ = sweep.communicate(timeout=300)
    assert sweep.returncode == 0, output
    ((_, (status, found)),) = tree(tmp_path).items()
    assert status == "FINISHED"
    assert [status for status, _ in found.values()] == ["FINISHED"] * 2


@pytest.mark.slow
def test_a_sweep_that_is_killed_continues_in_the_same_mlflow_runs(tmp_path):
    command = [sys.executable, "-m", "fieldrl.app.main", "-m", *TINY[:1], "evaluation_episodes=0"]
    jobs = ["replicates=1", "episodes=60", "seed=0,1", "hydra/launcher=joblib", "hydra.launcher.n_jobs=1"]
    sweep = subprocess.Popen([*command, *jobs], cwd=tmp_path, stdout=subprocess.DEVNULL)
    _holder(tmp_path / "outputs" / ".locks")
    sweep.kill()
    sweep.wait()
    finished = fieldrl(tmp_path, *command[3:], *jobs)
    assert finished.returncode == 0, finished.stderr
    ((_, (status, found)),) = tree(tmp_path).items()
    assert status == "FINISHED"
    assert [status for status, _ in found.values()] == ["FINISHED"] * 2


def _holder(locks: Path, seconds: float = 120.0) -> int:
    """The process that computes the first run of a sweep, as soon as there is one."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for path in locks.glob("*.holder"):
            if "-sweep-" in path.name:
                continue
            words = path.read_text().split()
            if len(words) > 1:
                return int(words[1])
        time.sleep(0.02)
    raise AssertionError("no run was begun")
