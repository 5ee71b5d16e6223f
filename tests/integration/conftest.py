"""What the tests of whole runs share: a small run, by a process of its own or in this one."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path

import pytest

from pipelines.faults.fuzz_workers import without_figures
from tests.integration import forked

_BUDGET = ("episodes=3", "steps=4", "evaluation_episodes=2", "replicates=2")
_shared: list[Path] = []
SMALL = ("experiment=advection", *_BUDGET)
UNTRACKED = (*SMALL, "tracking=none")
SMALLEST = ("episodes=1", "steps=2", "evaluation_episodes=0", "replicates=1", "tracking=none")


def fieldrl(
    folder: Path, *arguments: str, figures: bool = False, tables: bool = True, **environment: str
) -> subprocess.CompletedProcess[str]:
    """The command in ``folder``, forked from a process that has imported everything.

    Where it tracks its run, and with ``tables``, the database is there already: making one takes MLflow
    longer than a small run.
    """
    database = folder / "outputs" / "mlflow.db"
    if tables and "tracking=none" not in arguments and not database.exists():
        database.parent.mkdir(exist_ok=True)
        shutil.copy(forked.empty_database(_shared[0]), database)
    with closing(forked.Command(folder, arguments, environment, figures)) as command:
        return command.wait()


def begun(folder: Path, *arguments: str) -> AbstractContextManager[forked.Command]:
    """The same, begun; it ends with the block."""
    return closing(forked.Command(folder, arguments, {}, figures=False))


def fieldrl_anew(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command, as a user starts it in ``folder``."""
    return subprocess.run(
        [sys.executable, "-m", "fieldrl.cli.main", *arguments],
        cwd=folder, capture_output=True, text=True, env=os.environ | environment, check=False, timeout=300,
    )  # fmt: skip


@pytest.fixture(autouse=True, scope="session")
def _of_all_workers(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The folder that all workers of this test session share."""
    own = tmp_path_factory.getbasetemp()
    _shared[:] = [own.parent if "PYTEST_XDIST_WORKER" in os.environ else own]


@pytest.fixture(autouse=True, scope="session")
def _commands_can_be_interrupted() -> None:
    """Tests in the background of a script ignore Ctrl-C, and so would the commands that they start."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def summary(folder: Path, output_dir: str = "outputs") -> dict:
    """The summary of the only run in an output folder."""
    (path,) = (folder / output_dir / "runs").glob("*/summary.json")
    return json.loads(path.read_text())


@pytest.fixture
def run_here(tmp_path, monkeypatch, capfd) -> Callable[..., tuple[int, str, str]]:
    """Run the command in this process, in an empty folder: (status, output, errors)."""
    from fieldrl.cli.main import main

    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("HYDRA_FULL_ERROR", raising=False)

    def run(*arguments: str, figures: bool = False) -> tuple[int, str, str]:
        with nullcontext() if figures else without_figures():
            status = main(["parallel=serial", *arguments])
        return status, *capfd.readouterr()

    return run
