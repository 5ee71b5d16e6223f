"""A sweep in MLflow: a parent, a child for each job, grandchildren for replicates."""

from __future__ import annotations

import os
import signal
import sqlite3
import time
from pathlib import Path

import pytest

from tests.integration.conftest import begun, fieldrl

TINY = ("experiment=advection", "episodes=2", "steps=3", "evaluation_episodes=1", "parallel=serial")
SWEEP = ("-m", *TINY, "replicates=2", "agent.step_size=0.5,-1")
KILLED = (
    "-m", *TINY[:1], "evaluation_episodes=0", "replicates=1", "episodes=60", "seed=0,1",
    "hydra/launcher=joblib",
)  # fmt: skip


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
    assert name.startswith("advection sweep:")
    assert status == "FAILED"
    assert sorted(status for status, _ in jobs.values()) == ["FAILED", "FINISHED"]
    ((good, replicates),) = [(name, below) for name, (status, below) in jobs.items() if below]
    assert replicates == {f"replicate {i} of {good}": ("FINISHED", {}) for i in range(2)}


def test_a_failed_job_carries_its_reason(swept):
    reasons = query(swept, "select value from tags where key = 'reason'")
    assert reasons == [("agent.step_size=-1: must lie in (0, 1]",)]


def test_the_parent_has_the_overrides_the_best_job_and_the_table(swept):
    ((parent,),) = query(swept, "select run_uuid from runs where name like '% sweep: %'")
    found = tags(swept, parent)
    (summary,) = (swept / "outputs" / "runs").glob("*/summary.json")
    assert found["best"] == summary.parent.name.rpartition("-")[2]
    assert "agent.step_size=0.5,-1" in found["overrides"]
    params = dict(query(swept, f"select key, value from params where run_uuid = '{parent}'"))
    assert params["agent.step_size"] == "0.5,-1"
    artifacts = swept / "outputs" / "mlartifacts" / "advection" / parent / "artifacts"
    names = {str(path.relative_to(artifacts)) for path in artifacts.rglob("*") if path.is_file()}
    assert {"results.csv", "figures/results.png"} <= names


def test_two_sweeps_that_share_a_run_both_have_it(tmp_path):
    for seeds in ("0,1", "1"):
        finished = fieldrl(tmp_path, "-m", *TINY, "replicates=1", f"seed={seeds}")
        assert finished.returncode == 0, finished.stderr
    keys: dict[str, set[str]] = {}
    for (run,) in query(tmp_path, "select run_uuid from runs"):
        found = tags(tmp_path, run)
        if "job" in found:
            keys.setdefault(found["mlflow.parentRunId"], set()).add(found["key"])
    first, second = keys.values()
    assert sorted([len(first), len(second)]) == [1, 2]
    assert len(first & second) == 1
    names = {name for _, jobs in tree(tmp_path).values() for name in jobs}
    assert names == {"seed=0", "seed=1", "episodes=2 steps=3 evaluation_episodes=1 replicates=1 seed=1"}


def test_a_sweep_over_experiments_has_every_run_in_its_own_and_adopts_what_was_tracked_before(tmp_path):
    (tmp_path / "conf" / "experiment").mkdir(parents=True)
    text = "# @package _global_\ndefaults:\n  - double_gyre\npde:\n  cells: [48, 24]\n"
    (tmp_path / "conf" / "experiment" / "coarse.yaml").write_text(text)
    budget = ("episodes=1", "steps=2", "evaluation_episodes=0", "replicates=2", "parallel=serial")
    common = (*budget, f"--config-dir={tmp_path / 'conf'}")
    sweep = ("-m", "experiment=advection,coarse")
    for arguments in (("experiment=coarse",), sweep, sweep):  # tracked on its own, adopted, found again
        finished = fieldrl(tmp_path, *arguments, *common)
        assert finished.returncode == 0, finished.stderr
        assert "MLflow did not" not in finished.stdout
    text = "select e.name, r.name, r.status from runs r join experiments e using (experiment_id)"
    for experiment, name, status in query(tmp_path, text):
        assert experiment in name
        assert status == "FINISHED"
    ((name, (status, jobs)),) = tree(tmp_path).items()
    assert status == "FINISHED"
    assert name.startswith("advection sweep:")
    assert [status for status, _ in jobs.values()] == ["FINISHED"] * 2
    on_its_own = "coarse episodes=1 steps=2 evaluation_episodes=0 replicates=2"  # keeps its name
    assert sorted(jobs) == [on_its_own, "experiment=advection"]
    assert [len(replicates) for _, replicates in jobs.values()] == [2, 2]
    records = (tmp_path / "outputs" / "mlartifacts").rglob("record.nc")
    assert sorted(path.parents[2].name for path in records) == ["advection", "coarse"]


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_its_job_alone_and_mlflow_shows_every_job_once(tmp_path):
    with begun(tmp_path, *KILLED, "hydra.launcher.n_jobs=2") as sweep:
        os.kill(_holder(tmp_path / "outputs" / ".locks"), signal.SIGKILL)
        finished = sweep.wait()
    assert finished.returncode == 0, finished
    ((_, (status, found)),) = tree(tmp_path).items()
    assert status == "FINISHED"
    assert [status for status, _ in found.values()] == ["FINISHED"] * 2


@pytest.mark.slow
def test_a_sweep_that_is_killed_continues_in_the_same_mlflow_runs(tmp_path):
    command = (*KILLED, "hydra.launcher.n_jobs=1")
    with begun(tmp_path, *command) as sweep:
        _holder(tmp_path / "outputs" / ".locks")
        sweep.kill()
    finished = fieldrl(tmp_path, *command)
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
