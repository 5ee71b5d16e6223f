"""An interrupted run goes on, on the same command, and ends as if it had never been interrupted."""

from __future__ import annotations

import functools
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr

from fieldrl.mission.learning import Replicate
from fieldrl.runs import job
from fieldrl.runs.checkpoints import Checkpoints
from fieldrl.runs.folder import VARIES
from tests.integration.conftest import UNTRACKED, fieldrl, summary

GYRE = (
    "experiment=double_gyre", "pde.cells=[48,24]", "episodes=2", "steps=2", "evaluation_episodes=1",
    "replicates=2", "tracking=none",
)  # fmt: skip
RUNS = {
    "advection": UNTRACKED,
    "a random agent and vague positions": (
        *UNTRACKED,
        "agent=random",
        "vehicle.sensor.covariance=[1,1,0.01]",
    ),
    "double gyre": GYRE,
}


@pytest.fixture
def often(monkeypatch) -> None:
    """A checkpoint after every episode."""
    monkeypatch.setattr(job, "Checkpoints", functools.partial(Checkpoints, period=0.0))
    monkeypatch.setattr("fieldrl.runs.checkpoints.SHARE", 1e9)


@pytest.fixture
def interrupted(monkeypatch):
    """Have the run interrupted after so many episodes of all replicates."""
    advance = Replicate.advance

    def after(episodes: int | None) -> None:
        left = [episodes]

        def stop(self: Replicate) -> None:
            if left[0] == 0:
                raise KeyboardInterrupt
            if left[0] is not None:
                left[0] -= 1
            advance(self)

        monkeypatch.setattr(Replicate, "advance", stop)

    return after


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Callable[..., Path]:
    """The output folder of a command to which nothing happens."""

    @functools.cache
    def run(*overrides: str) -> Path:
        folder = tmp_path_factory.mktemp("whole")
        finished = fieldrl(folder, *overrides, "parallel=serial")
        assert finished.returncode == 0, finished.stderr
        return folder / "outputs"

    return run


@pytest.fixture
def done(whole, tmp_path) -> Path:
    """The output folder of a finished run, a copy."""
    return shutil.copytree(whole(*UNTRACKED), tmp_path / "outputs")


def results(folder: Path) -> tuple[xr.Dataset, dict]:
    (path,) = (folder / "runs").glob("*/record.nc")
    found = json.loads((path.parent / "summary.json").read_text())
    return xr.load_dataset(path, engine="netcdf4"), found | dict.fromkeys(VARIES)


def check_same(folder: Path, reference: Path) -> None:
    (record, found), (expected, wanted) = results(folder), results(reference)
    xr.testing.assert_identical(record, expected)
    assert found == wanted


@pytest.mark.usefixtures("often")
@pytest.mark.parametrize("overrides", RUNS.values(), ids=RUNS)
def test_a_run_interrupted_twice_ends_bit_for_bit_as_one_that_was_not(
    run_here, tmp_path, whole, interrupted, overrides
):
    for episodes in (1, 4):
        interrupted(episodes)
        status, _, errors = run_here(*overrides)
        assert status == 130
        assert errors == "\ninterrupted; finished runs are kept, the same command continues this one\n"
    interrupted(None)
    status, output, errors = run_here(*overrides)
    assert (status, errors) == (0, "")
    assert "continued from its last checkpoint: " in output
    assert "continued after an interruption" in output
    check_same(tmp_path / "outputs", whole(*overrides))
    (folder,) = (tmp_path / "outputs" / "runs").iterdir()
    assert not (folder / "checkpoints").exists()


@pytest.mark.usefixtures("often")
def test_a_replicate_that_was_finished_is_not_computed_again(run_here, interrupted, monkeypatch):
    interrupted(7)  # replicate 0 has five episodes and its end
    run_here(*UNTRACKED)
    interrupted(None)
    computed = _computed(monkeypatch)
    assert run_here(*UNTRACKED)[0] == 0
    assert computed == [1] * 5


@pytest.mark.usefixtures("often")
def test_force_starts_afresh(run_here, interrupted):
    interrupted(2)
    run_here(*UNTRACKED)
    interrupted(None)
    status, output, _ = run_here(*UNTRACKED, "force=true")
    assert status == 0
    assert "continued" not in output


@pytest.mark.usefixtures("often")
def test_a_damaged_checkpoint_is_one_line_and_changes_nothing(run_here, tmp_path, whole, interrupted):
    interrupted(3)
    run_here(*UNTRACKED)
    (path,) = (tmp_path / "outputs" / "runs").glob("*/checkpoints/replicate-0")
    path.write_bytes(path.read_bytes()[:1000])
    interrupted(None)
    status, output, errors = run_here(*UNTRACKED)
    assert status == 0
    assert "2 of 10 episodes are done" in output
    assert errors == f"{path}: is damaged and is left out\n"
    check_same(tmp_path / "outputs", whole(*UNTRACKED))


def test_a_short_run_leaves_no_checkpoints(done):
    assert not list(done.rglob("replicate-*"))
    assert "late_e_total" in summary(done.parent)


DAMAGE = {"truncated": lambda b: b[: len(b) // 2], "garbled": lambda b: b[:-300] + b"#" * 100 + b[-200:]}


def _computed(monkeypatch) -> list[int]:
    """Of which replicates episodes are computed from now on."""
    numbers: list[int] = []
    advance = Replicate.advance
    monkeypatch.setattr(Replicate, "advance", lambda self: (numbers.append(self.number), advance(self))[1])
    return numbers


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_record_is_one_line_and_is_computed_again(run_here, done, whole, damage):
    (path,) = (done / "runs").glob("*/record.nc")
    path.write_bytes(damage(path.read_bytes()))
    status, _, errors = run_here(*UNTRACKED)
    assert status == 0
    assert errors == f"{path}: is damaged; the run is done again\n"
    check_same(done, whole(*UNTRACKED))


@pytest.mark.parametrize("damage", [*DAMAGE.values(), None], ids=[*DAMAGE, "gone"])
def test_a_damaged_summary_is_made_again_from_the_record(run_here, done, whole, monkeypatch, damage):
    (path,) = (done / "runs").glob("*/summary.json")
    path.unlink() if damage is None else path.write_bytes(damage(path.read_bytes()))
    computed = _computed(monkeypatch)
    status, _, errors = run_here(*UNTRACKED)
    assert (status, errors, computed) == (0, "", [])
    check_same(done, whole(*UNTRACKED))
