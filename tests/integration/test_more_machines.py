"""The same sweep gives the same summaries wherever its jobs are done."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest
import xarray as xr

from fieldrl.cli.compose import composed
from fieldrl.runs.folder import VARIES
from tests.integration.conftest import fieldrl

BUDGET = ("experiment=advection", "episodes=2", "steps=3", "evaluation_episodes=0", "tracking=none")
SWEEP = ("-m", *BUDGET, "replicates=2", "seed=0,1")

needs_dask = pytest.mark.skipif(not find_spec("distributed"), reason="the extra dask is not installed")
needs_submitit = pytest.mark.skipif(
    not find_spec("hydra_plugins.hydra_submitit_launcher"), reason="the extra slurm is not installed"
)


def results(folder: Path) -> dict[str, tuple[dict, xr.Dataset]]:
    """Summary and record of every run by its name, without what the clock says and the file's digest."""
    found = {}
    for path in (folder / "runs").glob("*/summary.json"):
        summary = json.loads(path.read_text()) | dict.fromkeys(VARIES)
        found[path.parent.name] = summary, xr.load_dataset(path.with_name("record.nc"), engine="netcdf4")
    return found


def agree(ours: dict[str, tuple[dict, xr.Dataset]], theirs: dict[str, tuple[dict, xr.Dataset]]) -> None:
    """The same runs with the same numbers, bit for bit; says which differ."""
    assert ours.keys() == theirs.keys()
    for name, (summary, record) in ours.items():
        other_summary, other = theirs[name]
        differ = [str(key) for key in record.variables if not record[key].identical(other[key])]
        assert (name, differ, record.identical(other)) == (name, [], True)
        assert summary == other_summary


@pytest.fixture(scope="module")
def here(tmp_path_factory) -> dict[str, tuple[dict, xr.Dataset]]:
    """What the sweep gives in one process."""
    folder = tmp_path_factory.mktemp("here")
    finished = fieldrl(folder, *SWEEP, "parallel=serial")
    assert finished.returncode == 0, finished.stderr
    return results(folder / "outputs")


@pytest.fixture
def address(tmp_path) -> Iterator[str]:
    """The scheduler of a Dask cluster of two local workers."""
    file = tmp_path / "scheduler.json"
    dask, common = [sys.executable, "-m", "dask"], ["--no-dashboard", "--scheduler-file", str(file)]
    commands = (
        [*dask, "scheduler", "--port", "0", *common],
        [*dask, "worker", "--nworkers", "2", "--nthreads", "1", *common],
    )
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    processes = [subprocess.Popen(command, cwd=tmp_path, **quiet) for command in commands]
    end = time.monotonic() + 60
    while not (file.exists() and file.read_text().endswith("}")) and time.monotonic() < end:
        time.sleep(0.1)  # it is not written at one blow
    found = json.loads(file.read_text())["address"]
    with import_module("distributed").Client(found) as client:
        client.wait_for_workers(2, timeout=60)
    yield found
    for process in reversed(processes):
        process.terminate()
        process.wait(timeout=60)


@needs_dask
@pytest.mark.slow
def test_on_a_dask_cluster_of_two_workers(tmp_path, here, address):
    finished = fieldrl(tmp_path, *SWEEP, "parallel=dask", f"parallel.address={address}")
    assert finished.returncode == 0, finished.stderr
    assert "2 jobs on 2 workers" in finished.stdout
    agree(results(tmp_path / "outputs"), here)
    arguments = (*BUDGET, "replicates=2", "seed=0", "parallel=dask", f"parallel.address={address}")
    finished = fieldrl(tmp_path, *arguments, "output_dir=replicates")  # a run's replicates on the cluster
    assert finished.returncode == 0, finished.stderr
    ((name, result),) = results(tmp_path / "replicates").items()
    agree({name: result}, {name: here[name]})


@needs_submitit
@pytest.mark.slow
def test_by_submitit_as_on_slurm(tmp_path, here):
    finished = fieldrl(tmp_path, *SWEEP, "hydra/launcher=submitit_local", "parallel=serial")
    assert finished.returncode == 0, finished.stderr
    agree(results(tmp_path / "outputs"), here)


@needs_submitit
def test_the_slurm_launcher_composes():
    assert composed(["hydra/launcher=slurm", "hydra.launcher.partition=short"])["seed"] == 0


@needs_dask
@pytest.mark.parametrize(
    ("address", "words"),
    [("null", "parallel.address=null: must be"), ("tcp://127.0.0.1:9", "no scheduler with a worker answers")],
)
def test_without_a_scheduler_nothing_is_left(tmp_path, monkeypatch, run_here, address, words):
    monkeypatch.setattr("fieldrl.parallel.dask._PATIENCE", 1)
    status, output, errors = run_here(
        "-m", *BUDGET, "seed=0,1", "parallel=dask", f"parallel.address={address}"
    )
    assert (status, output) == (1, "")
    assert words in errors
    assert len(errors.strip().splitlines()) <= 3
    assert list(tmp_path.iterdir()) == []
