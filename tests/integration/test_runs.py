"""Whole runs, small: identity, reuse, files, workers, sweeps, interruptions."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time

import pytest
import xarray as xr

from fieldrl.runs.folder import VARIES
from tests.integration.conftest import SMALL, UNTRACKED, begun, fieldrl, fieldrl_anew, summary

SCHEMA = {
    "experiment", "key", "seed", "replicates", "episodes", "steps", "finished", "seconds", "version",
    "parameters", "best_episode", "e_f", "e_cv", "e_total", "theta_error", "field_rmse", "forward_solves",
    "converged", "replicates_table", "pooled", "verdict",
}  # fmt: skip


def record(folder, output_dir="outputs") -> xr.Dataset:
    (path,) = (folder / output_dir / "runs").glob("*/record.nc")
    with xr.open_dataset(path, engine="netcdf4") as found:
        return found.load()


def test_a_run_leaves_its_five_things_and_nothing_else(run_here, tmp_path):
    status, output, errors = run_here(*UNTRACKED, figures=True)
    assert (status, errors) == (0, "")
    (folder,) = (tmp_path / "outputs" / "runs").iterdir()
    left = {".hydra", "record.nc", "summary.json", "figures", "report.html"}
    assert {path.name for path in folder.iterdir()} == left
    assert {path.name for path in (folder / ".hydra").iterdir()} == {
        "config.yaml",
        "hydra.yaml",
        "overrides.yaml",
    }
    assert {path.name for path in (folder / "figures").glob("*.png")} >= {"path.png", "learning_curve.png"}
    assert {path.name for path in tmp_path.iterdir()} == {"outputs"}
    assert {path.name for path in (tmp_path / "outputs").iterdir()} == {"runs", ".locks"}
    assert folder.name in output


def test_the_summary_has_every_key_of_the_schema(run_here, tmp_path):
    run_here(*UNTRACKED)
    found = summary(tmp_path)
    assert found.keys() >= SCHEMA
    assert found["finished"] is True
    trust = {"std", "interval", "identified"}
    assert found["parameters"]["b_x"].keys() == {"true", "estimate", "unit"} | trust
    assert found["pooled"]["parameters"]["b_x"].keys() == {"estimate"} | trust
    low, high = found["pooled"]["parameters"]["b_x"]["interval"]
    assert low < high
    assert len(found["replicates_table"]) == 2


def test_the_output_is_plain_and_fits_80_columns_where_there_is_no_terminal(run_here):
    _, output, _ = run_here(*UNTRACKED)
    assert "\x1b" not in output
    assert max(len(line) for line in output.splitlines()) <= 80


def test_a_finished_run_is_not_computed_again(run_here, tmp_path):
    run_here(*UNTRACKED)
    (path,) = (tmp_path / "outputs" / "runs").glob("*/record.nc")
    before = path.stat().st_mtime_ns
    status, output, _ = run_here(*UNTRACKED)
    assert status == 0
    assert "finished before" in output
    assert "b_x" in output
    assert path.stat().st_mtime_ns == before


def test_force_computes_a_finished_run_again_with_the_same_result(run_here, tmp_path):
    run_here(*UNTRACKED)
    first, result = record(tmp_path), summary(tmp_path)
    _, output, _ = run_here(*UNTRACKED, "force=true")
    assert "finished before" not in output
    xr.testing.assert_identical(record(tmp_path), first)
    assert summary(tmp_path) | dict.fromkeys(VARIES) == result | dict.fromkeys(VARIES)


def test_the_number_of_workers_does_not_change_a_bit(tmp_path):
    for jobs in (1, 2):
        finished = fieldrl(
            tmp_path, *SMALL, "replicates=3", "tracking=none", f"parallel.jobs={jobs}", f"output_dir=by{jobs}"
        )
        assert finished.returncode == 0, finished.stderr
        assert finished.stderr == ""
    xr.testing.assert_identical(record(tmp_path, "by2"), record(tmp_path, "by1"))


def test_a_replicate_does_not_depend_on_how_many_there_are(run_here, tmp_path):
    run_here(*UNTRACKED, "replicates=1", "output_dir=one")
    run_here(*UNTRACKED, "replicates=2", "output_dir=two")
    first, both = record(tmp_path, "one"), record(tmp_path, "two")
    xr.testing.assert_equal(first.isel(replicate=0), both.isel(replicate=0))


def test_a_run_with_a_garbled_summary_is_computed_again(run_here, tmp_path):
    run_here(*UNTRACKED)
    (path,) = (tmp_path / "outputs" / "runs").glob("*/summary.json")
    path.write_text(path.read_text()[:50])
    status, output, _ = run_here(*UNTRACKED)
    assert status == 0
    assert "finished before" not in output
    assert json.loads(path.read_text())["finished"] is True


def test_a_write_that_fails_says_so_and_keeps_the_finished_run(run_here, tmp_path, monkeypatch):
    run_here(*UNTRACKED)
    result = summary(tmp_path)

    def full(*_args, **_options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", full)
    status, _, errors = run_here(*UNTRACKED, "force=true")
    assert status == 1
    assert "No space left on device" in errors
    assert 1 <= len(errors.strip().splitlines()) <= 3
    assert summary(tmp_path) == result
    assert not list((tmp_path / "outputs" / "runs").glob("*/.*.tmp"))


def test_two_processes_asked_for_the_same_run_share_one_result(tmp_path):
    command = *UNTRACKED, "episodes=150", "parallel.jobs=1"
    with begun(tmp_path, *command) as first, begun(tmp_path, *command) as second:
        both = first.wait(), second.wait()
    assert [finished.returncode for finished in both] == [0, 0], both
    assert sum("finished before" in finished.stdout for finished in both) == 1
    summary(tmp_path)


def test_an_interrupt_ends_with_130_and_one_line(tmp_path):
    with begun(tmp_path, *UNTRACKED, "episodes=100000") as process:
        _wait_for(tmp_path / "outputs" / ".locks")
        time.sleep(3)
        os.killpg(process.pid, signal.SIGINT)
        finished = process.wait()
    assert finished.returncode == 130
    assert len(finished.stderr.strip().splitlines()) == 1, finished
    assert not list((tmp_path / "outputs").glob("runs/*/summary.json"))


def _wait_for(path, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not path.exists():
        assert time.monotonic() < end, f"{path} did not appear"
        time.sleep(0.05)


@pytest.mark.parametrize("launcher", ["basic", "joblib"])
def test_a_sweep_runs_every_job_and_puts_nothing_strange_anywhere(tmp_path, launcher):
    finished = fieldrl(tmp_path, "-m", *UNTRACKED, "replicates=1", "seed=0,1", f"hydra/launcher={launcher}")
    assert finished.returncode == 0, finished.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"outputs"}
    assert {path.name for path in (tmp_path / "outputs").iterdir()} == {"runs", "sweeps", ".locks"}
    assert len(list((tmp_path / "outputs" / "runs").glob("*/summary.json"))) == 2


def test_a_job_of_a_sweep_that_fails_does_not_stop_the_others(tmp_path):
    finished = fieldrl(tmp_path, "-m", *UNTRACKED, "vehicle.max_speed=-1,5", "parallel=serial")
    assert finished.returncode == 1
    assert "vehicle.max_speed=-1: must be > 0" in finished.stdout
    assert finished.stderr == "1 of 2 jobs failed; the same command tries them again\n"
    assert summary(tmp_path)["finished"] is True


def test_the_command_works_where_the_configuration_is_not(tmp_path):
    finished = fieldrl_anew(tmp_path, "--cfg", "job")
    assert finished.returncode == 0
    assert "max_speed: 10.0" in finished.stdout
    assert list(tmp_path.iterdir()) == []


def test_help_names_groups_options_and_keys_in_half_a_second_of_processor_time(tmp_path):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    finished = fieldrl_anew(tmp_path, "--help")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = ("agent", "sarsa_lambda", "lawnmower", "experiment", "episodes", "output_dir", "-m")
    assert all(word in finished.stdout for word in words)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 0.5


def test_help_imports_nothing_heavy(tmp_path):
    code = (
        "import sys; from fieldrl.cli.main import main; main(['--help']); "
        "print({'hydra', 'numba', 'mlflow', 'rich', 'xarray'} & set(sys.modules))"
    )
    finished = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert finished.stdout.splitlines()[-1] == "set()"
