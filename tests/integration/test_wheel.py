"""The wheel, installed elsewhere, without the checkout."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.integration.conftest import UNTRACKED, summary

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The built wheel."""
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    finished = subprocess.run(build, capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stdout + finished.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Path:
    """A folder with only the wheel in it; the dependencies come from this environment."""
    folder = tmp_path_factory.mktemp("installed")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target"]
    subprocess.run([*install, str(folder), str(wheel)], check=True, capture_output=True)
    _lend_compiled_loops(folder)
    return folder


def _lend_compiled_loops(folder: Path) -> None:
    """Give the installed files, which are those of the checkout, what the checkout has compiled of them."""
    for source in (ROOT / "fieldrl").rglob("*.py"):
        copy, times = folder / source.relative_to(ROOT), source.stat()
        assert copy.read_bytes() == source.read_bytes()
        os.utime(copy, ns=(times.st_atime_ns, times.st_mtime_ns))  # by which numba knows a file
    for compiled in (ROOT / "fieldrl").rglob("__pycache__/*.nb[ic]"):
        place = folder / compiled.relative_to(ROOT)
        place.parent.mkdir(exist_ok=True)
        shutil.copy(compiled, place)


def command(installed: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(installed)}
    return subprocess.run(
        [sys.executable, "-m", "fieldrl.cli.main", *arguments],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_the_wheel_holds_package_and_configuration_and_no_tests(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert "fieldrl/cli/main.py" in names
    assert "fieldrl/conf/config.yaml" in names
    assert "fieldrl/conf/experiment/advection.yaml" in names
    assert not any(name.startswith(("tests", "conf/", "outputs")) for name in names)


def test_help_from_the_wheel_reads_the_packed_configuration(installed, tmp_path):
    finished = command(installed, tmp_path, "--help")
    assert finished.returncode == 0, finished.stderr
    assert str(installed / "fieldrl" / "conf") in finished.stdout
    assert "sarsa_lambda" in finished.stdout


def test_a_run_and_a_sweep_from_the_wheel_in_an_empty_folder(installed, tmp_path):
    finished = command(installed, tmp_path, *UNTRACKED)
    assert finished.returncode == 0, finished.stderr
    assert summary(tmp_path)["finished"] is True
    finished = command(installed, tmp_path, "-m", *UNTRACKED)  # finds its sweeper, and the run
    assert finished.returncode == 0, finished.stderr
    assert "1 finished before" in finished.stdout
