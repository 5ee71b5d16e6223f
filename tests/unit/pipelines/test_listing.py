"""``python -m pipelines``: what can be run, found by itself; an old name says its new one."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

from pipelines import moved
from pipelines.__main__ import described, entries, folders

ENTRIES = {entry.name: entry for folder in folders().values() for entry in entries(folder)}
INDEXED = {name: path for name, path in folders().items() if "\n- ``" in described(path / "__init__.py")}


def test_the_list_says_what_each_is_and_how_long_it_takes():
    heavy = "import sys; from pipelines.__main__ import main; main(); assert 'numpy' not in sys.modules"
    finished = subprocess.run([sys.executable, "-c", heavy], capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    for name, what, duration in ENTRIES.values():
        assert f"  {name}{duration and f'  ({duration})'}\n" in finished.stdout
        assert what.split()[0] in finished.stdout
    assert max(map(len, finished.stdout.splitlines())) <= 100


def test_it_has_every_file_that_runs_as_a_command():
    for path in (path for folder in folders().values() for path in folder.glob("*.py")):
        name = ".".join(("pipelines", path.parent.name, *([] if path.stem == "__main__" else [path.stem])))
        runs = 'if __name__ == "__main__":' in path.read_text()
        assert runs == (name in ENTRIES) or path.name == "fuzz_workers.py", name  # the fuzzer's own process


def test_paper_benchmarks_and_faults_have_an_index():
    assert {"paper", "benchmarks", "faults", "calibration"} <= INDEXED.keys()


@pytest.mark.parametrize("folder", INDEXED.values(), ids=INDEXED)
def test_an_index_has_every_file_and_each_pipeline_says_how_long_it_takes(folder):
    silent = [entry.name for entry in entries(folder) if not entry.duration]
    assert silent == [], 'their docstrings need a line "Takes ... minutes."'
    index = described(folder / "__init__.py")
    missing = [path.stem for path in folder.glob("*.py") if f"``{path.stem}``" not in index]
    assert [name for name in missing if not name.startswith("__")] == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("fits", "benchmarks.fits"),
        ("table_2", "paper.table_2"),
        ("victims", "faults.victims"),
        ("benchmark", "benchmarks.fit_speed"),
    ],
)
def test_an_old_name_says_its_new_one(old, new):
    with pytest.raises(ModuleNotFoundError, match=f"pipelines.{old} is now pipelines.{new}"):
        import_module(f"pipelines.{old}")


def test_a_name_that_never_was_is_not_found():
    assert moved("nothing_of_ours") is None
    with pytest.raises(ModuleNotFoundError, match="No module named"):
        import_module("pipelines.nothing_of_ours")
