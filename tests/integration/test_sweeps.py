"""Sweeps: every job is done, a failure costs its job alone, and the same command continues."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from fieldrl.runs.folder import VARIES
from tests.integration.conftest import fieldrl

TINY = ("experiment=advection", "episodes=2", "steps=3", "evaluation_episodes=0", "replicates=1")
SWEEP = ("-m", *TINY, "tracking=none", "agent.step_size=0.5,0.9", "seed=0,1")


def sweep_folder(folder: Path) -> Path:
    (found,) = (folder / "outputs" / "sweeps").iterdir()
    return found


def table(folder: Path) -> list[dict[str, str]]:
    with (sweep_folder(folder) / "results.csv").open() as file:
        return list(csv.DictReader(file))


def summaries(folder: Path, output_dir: str = "outputs") -> dict[str, dict]:
    """Every summary by the run's name, without what the clock says."""
    paths = (folder / output_dir / "runs").glob("*/summary.json")
    return {path.parent.name: json.loads(path.read_text()) | dict.fromkeys(VARIES) for path in paths}


@pytest.fixture(scope="module")
def first(tmp_path_factory) -> tuple[Path, CompletedProcess[str]]:
    """A sweep of four jobs: its folder, and what the command said."""
    folder = tmp_path_factory.mktemp("first")
    return folder, fieldrl(folder, *SWEEP, "parallel=serial")


@pytest.fixture
def swept(first, tmp_path) -> Path:
    """A copy of its folder."""
    return shutil.copytree(first[0], tmp_path, dirs_exist_ok=True)


def test_a_sweep_runs_every_combination_and_leaves_a_table_and_a_picture(first, swept):
    tmp_path, output = swept, first[1].stdout
    assert (first[1].returncode, first[1].stderr) == (0, "")
    rows = table(tmp_path)
    assert [(row["agent.step_size"], row["seed"]) for row in rows] == [
        ("0.5", "0"), ("0.5", "1"), ("0.9", "0"), ("0.9", "1"),
    ]  # fmt: skip
    found = summaries(tmp_path)
    assert {row["run"] for row in rows} == set(found)
    for row in rows:
        assert float(row["late_e_total"]) == found[row["run"]]["late_e_total"][0]
        assert row["status"] == "finished"
    best = min(rows, key=lambda row: float(row["late_e_total"]))
    assert f"best    outputs/runs/{best['run']}" in output
    note = json.loads((sweep_folder(tmp_path) / "figures" / "results.json").read_text())
    assert note["keys"] == [row["run"].rpartition("-")[2] for row in rows]
    assert (sweep_folder(tmp_path) / "figures" / "results.png").exists()
    assert {path.name for path in (tmp_path / "outputs").iterdir()} == {"runs", "sweeps", ".locks"}


def test_the_output_fits_80_columns_where_there_is_no_terminal(first):
    output = first[1].stdout
    assert "\x1b" not in output
    assert max(len(line) for line in output.splitlines()) <= 80


def test_the_same_command_again_finds_everything_and_computes_nothing(run_here, swept):
    tmp_path = swept
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "outputs" / "runs").rglob("*")}
    csv_before = (sweep_folder(tmp_path) / "results.csv").read_text()
    status, output, _ = run_here(*SWEEP[:-2], *SWEEP[:-3:-1])  # the order of the keys does not matter
    assert status == 0
    assert "4 finished before" in output
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "outputs" / "runs").rglob("*")} == before
    assert len(csv_before.splitlines()) == len(
        (sweep_folder(tmp_path) / "results.csv").read_text().splitlines()
    )


def test_what_a_run_that_was_killed_at_its_very_end_has_left_is_removed(run_here, swept):
    left = [path.parent / "checkpoints" for path in (swept / "outputs" / "runs").glob("*/summary.json")]
    for path in left:
        path.mkdir()
    assert run_here(*SWEEP)[0] == 0
    assert not any(path.exists() for path in left)


def test_only_what_is_missing_is_computed(run_here, swept):
    status, output, _ = run_here("-m", *TINY, "tracking=none", "agent.step_size=0.9", "seed=range(3)")
    assert status == 0
    assert "3 jobs, 2 finished before" in output
    assert len(summaries(swept)) == 5


def test_a_job_that_fails_costs_only_itself(run_here, tmp_path):
    status, output, errors = run_here("-m", *TINY, "tracking=none", "agent.step_size=0.5,-1,0.9")
    assert status == 1
    assert errors.strip() == "1 of 3 jobs failed; the same command tries them again"
    assert "agent.step_size=-1: must lie in (0, 1]" in output
    assert [row["status"] for row in table(tmp_path)] == ["finished", "failed", "finished"]
    assert table(tmp_path)[1]["reason"] == "agent.step_size=-1: must lie in (0, 1]"


def test_a_job_that_breaks_in_the_middle_costs_only_itself(run_here, tmp_path, monkeypatch):
    from fieldrl.runs import job

    compute = job._compute

    def breaks(work, *arguments, **options):
        if work.config["seed"] == 1:
            raise MemoryError
        return compute(work, *arguments, **options)

    monkeypatch.setattr(job, "_compute", breaks)
    status, output, _ = run_here("-m", *TINY, "tracking=none", "seed=1,0")
    assert status == 1
    assert "not enough memory" in output
    assert [row["status"] for row in table(tmp_path)] == ["failed", "finished"]
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    status, output, _ = run_here("-m", *TINY, "tracking=none", "seed=1,0")
    assert status == 0
    assert "1 finished before" in output


def test_the_same_run_asked_for_twice_is_computed_once(run_here, tmp_path):
    status, _, _ = run_here("-m", *TINY, "tracking=none", "agent.step_size=0.5,0.50")
    assert status == 0
    assert len(summaries(tmp_path)) == 1
    first, second = table(tmp_path)
    assert first["run"] == second["run"]
    assert first["late_e_total"] == second["late_e_total"]


def test_in_worker_processes_the_results_are_the_same(first, tmp_path):
    finished = fieldrl(tmp_path, *SWEEP, "hydra/launcher=joblib", "hydra.launcher.n_jobs=2")
    assert finished.returncode == 0, finished.stderr
    assert finished.stderr == ""
    assert summaries(tmp_path) == summaries(first[0])


BAD = {
    "an unknown key": (("agent.step_sise=1,2",), ["agent.step_sise=1", "did you mean step_size?"]),
    "an unknown option": (("agent=foo,bar",), ["agent=foo", "lawnmower"]),
    "only bad values": (("agent.step_size=-1,-2",), ["agent.step_size=-1", "(0, 1]"]),
    "a list that does not end": (("vehicle.start=[1,2",), ["vehicle.start=[1,2", "cannot be read"]),
    "an interval": (("agent.step_size=interval(0,1)",), ["interval(0,1)", "hydra/sweeper=gp"]),
    "a key of hydra's": (("hydra.job.name=a,b",), ["hydra.job.name"]),
    "an unknown objective": (
        ("seed=0,1", "hydra.sweeper.objective=etotal"),
        ["objective=etotal", "late_e_total"],
    ),
    "an unknown direction": (("seed=0,1", "hydra.sweeper.direction=up"), ["direction=up", "minimise"]),
    "an unknown key of the sweeper": (("seed=0,1", "hydra.sweeper.goal=1"), ["hydra.sweeper.goal=1"]),
    "an output folder below a file": (("seed=0,1", "output_dir=/dev/null/x"), ["output_dir=/dev/null/x"]),
}


@pytest.mark.parametrize(("arguments", "wanted"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_refused_in_three_lines_and_leaves_nothing(run_here, tmp_path, arguments, wanted):
    status, output, errors = run_here("-m", *TINY, *arguments)
    assert (status, output) == (1, "")
    assert 1 <= len(errors.strip().splitlines()) <= 3, errors
    assert all(word in errors for word in wanted), errors
    assert "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []
