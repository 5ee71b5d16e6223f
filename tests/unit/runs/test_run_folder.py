"""Identity of a run, its folder, and files that are complete or absent."""

from __future__ import annotations

import json

import pytest

from fieldrl.core.checks import FieldrlError
from fieldrl.runs import atomic
from fieldrl.runs.folder import Run
from fieldrl.runs.identity import identity

CONFIG = {
    "seed": 0,
    "episodes": 4,
    "vehicle": {"max_speed": 10.0, "start": [20.0, 20.0]},
    "pde": {"cells": [20, 10], "solutions": {"memory": 512}},
    "estimator": {"starts": 1, "workers": 1},
    "output_dir": "outputs",
    "force": False,
    "parallel": {"jobs": -1},
    "tracking": {"uri": None},
}


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 1},
        {"episodes": 5},
        {"vehicle": {"max_speed": 10.5, "start": [20.0, 20.0]}},
        {"pde": {"cells": [20, 11], "solutions": {"memory": 512}}},
        {"estimator": {"starts": 2, "workers": 1}},
        {"vehicle": CONFIG["vehicle"] | {"solutions": 1}},
        {"cross_validation": "as_needed"},
    ],
)
def test_what_changes_a_result_changes_the_key(change):
    assert identity(CONFIG | change) != identity(CONFIG)


@pytest.mark.parametrize(
    "change",
    [
        {"output_dir": "x"},
        {"force": True},
        {"parallel": {"jobs": 1}},
        {"tracking": {"uri": "x"}},
        {"pde": {"cells": [20, 10], "solutions": {"memory": 1, "directory": "x"}}},
        {"estimator": {"starts": 1, "workers": 8}},
        {"cross_validation": "every_step"},
    ],
)
def test_what_cannot_change_a_result_does_not_change_the_key(change):
    assert identity(CONFIG | change) == identity(CONFIG)


def test_ten_and_ten_point_nought_are_the_same():
    assert identity(CONFIG | {"vehicle": {"max_speed": 10, "start": [20, 20.0]}}) == identity(CONFIG)


def test_the_order_of_keys_does_not_matter():
    assert identity(dict(reversed(CONFIG.items()))) == identity(CONFIG)


@pytest.fixture
def run(tmp_path) -> Run:
    found = Run("advection", "0123456789", tmp_path)
    found.folder.mkdir(parents=True)
    return found


def finish(run: Run, **changes) -> None:
    (run.folder / "record.nc").write_bytes(b"")
    (run.folder / "summary.json").write_text(json.dumps({"finished": True, "key": run.key} | changes))


def test_a_run_is_finished_when_its_summary_says_so(run):
    assert run.summary() is None
    finish(run)
    assert run.summary() == {"finished": True, "key": run.key}


def test_a_run_without_its_record_is_not_finished(run):
    finish(run)
    (run.folder / "record.nc").unlink()
    assert run.summary() is None


def test_a_summary_of_another_key_does_not_count(run):
    finish(run, key="9876543210")
    assert run.summary() is None


def test_a_file_that_cannot_be_completed_leaves_the_old_one(tmp_path):
    path = tmp_path / "result"
    atomic.write(path, "old")

    def fail(place):
        place.write_text("ha")
        raise OSError(28, "No space left on device")

    with pytest.raises(FieldrlError, match="No space left on device"):
        atomic.write(path, fail)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_replaces_a_folder(tmp_path):
    path = tmp_path / "figures"
    for name in ("old", "new"):

        def fill(place, name=name):
            place.mkdir()
            (place / name).touch()

        atomic.write(path, fill)
    assert [item.name for item in path.iterdir()] == ["new"]
    assert list(tmp_path.iterdir()) == [path]
