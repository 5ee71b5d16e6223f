"""The command ``fieldrl`` in a process of its own, forked from one that has imported everything."""

from __future__ import annotations

import atexit
import multiprocessing.process
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from multiprocessing import get_context
from pathlib import Path
from subprocess import CompletedProcess
from types import SimpleNamespace

from filelock import FileLock

_CONTEXT = get_context("forkserver")
_CONTEXT.set_forkserver_preload([
    "fieldrl.cli.launch", "fieldrl.cli.terminal", "fieldrl.cli.sweep_terminal", "fieldrl.figures",
    "fieldrl.mission", "fieldrl.runs.job", "fieldrl.runs.run_page", "fieldrl.sweeps.execution",
    "tests.integration.preloaded",
])  # fmt: skip
_PATIENCE = 300.0  # that a command may take [s]


def empty_database(shared: Path) -> Path:
    """MLflow's tables without a run, made once in a folder that all workers of a test session share."""
    path = shared / "mlflow.db"
    with FileLock(shared / "mlflow.db.lock"):
        if not path.exists():
            process = _CONTEXT.Process(target=_make_database, args=(path,))
            process.start()
            process.join(_PATIENCE)
    return path


def _make_database(path: Path) -> None:
    from fieldrl.tracking.database import Database

    making = path.parent / "making"
    Database(None, making).search("")
    (making / path.name).rename(path)


class Command:
    """The command, begun in ``folder`` as a process group of its own.

    Args:
        folder: where to.
        arguments: the command line.
        environment: variables besides those of this process.
        figures: whether a run draws its pictures, which take longer than a small run.
    """

    def __init__(
        self, folder: Path, arguments: Sequence[str], environment: Mapping[str, str], figures: bool
    ) -> None:
        self.arguments, self._said = arguments, Path(tempfile.mkdtemp(prefix="fieldrl-said-"))
        self._process = _CONTEXT.Process(
            target=_be_command, args=(folder, arguments, os.environ | environment, figures, self._said)
        )
        self._process.start()

    @property
    def pid(self) -> int:
        """Of its process, and of its group."""
        return self._process.pid or 0

    def wait(self) -> CompletedProcess[str]:
        """Its end: the exit status (negative: the signal that ended it), output and errors."""
        self._process.join(_PATIENCE)
        if self._process.exitcode is None:
            self.kill()
            raise TimeoutError(f"fieldrl {' '.join(self.arguments)}")
        texts = [path.read_text() if path.exists() else "" for path in _outputs(self._said)]
        return CompletedProcess(self.arguments, self._process.exitcode, *texts)

    def kill(self) -> None:
        """SIGKILL to all of its group."""
        with suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        self._process.join()

    def close(self) -> None:
        """End it, if it has not ended, and forget what it said."""
        if self._process.exitcode is None:
            self.kill()
        shutil.rmtree(self._said)


def _outputs(said: Path) -> tuple[Path, Path]:
    return said / "output.txt", said / "errors.txt"


def _be_command(
    folder: Path,
    arguments: Sequence[str],
    environment: Mapping[str, str],
    figures: bool,
    said: Path,
) -> None:
    from fieldrl.cli.main import main
    from fieldrl.tracking import mlflow
    from pipelines.faults.fuzz_workers import without_figures

    multiprocessing.process._parent_process = None  # type: ignore[attr-defined]  # a command, no worker
    os.setsid()
    os.environ.clear()
    os.environ.update(environment)
    sys.path[:0] = [path for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]
    os.chdir(folder)
    for number, path in enumerate(_outputs(said), 1):
        os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    sys.stdout, sys.stderr = (open(number, "w", buffering=1, closefd=False) for number in (1, 2))  # noqa: SIM115
    if "PYTHONPATH" not in environment:  # with modules of one's own: the process that users have
        known = {name: getattr(subprocess, name) for name in ("PIPE", "DEVNULL", "TimeoutExpired")}
        mlflow.subprocess = SimpleNamespace(Popen=_Publisher, **known)  # type: ignore[assignment]
    with nullcontext() if figures else without_figures():
        status = main(list(arguments))
    threading._shutdown()  # type: ignore[attr-defined]  # as the interpreter does before it ends
    atexit._run_exitfuncs()
    sys.exit(status)


class _Publisher:
    """The process that publishes for a command: forked, too, for it takes MLflow longer to be imported."""

    def __init__(
        self, command: Sequence[str], env: Mapping[str, str], start_new_session: bool = False, **_: object
    ) -> None:
        asked, answered = os.pipe(), os.pipe()
        self._process = get_context("fork").Process(
            target=self._publish, args=(command[-1], env, start_new_session, asked, answered)
        )
        self._process.start()
        os.close(asked[0])
        os.close(answered[1])
        self.stdin, self.stdout = os.fdopen(asked[1], "wb"), os.fdopen(answered[0], "rb")

    @staticmethod
    def _publish(
        step_back: str,
        environment: Mapping[str, str],
        new_session: bool,
        asked: tuple[int, int],
        answered: tuple[int, int],
    ) -> None:
        from fieldrl.tracking import publisher

        if new_session:
            os.setsid()
        os.environ.clear()
        os.environ.update(environment)
        for old, new in ((asked[0], 0), (answered[1], 1), (os.open(os.devnull, os.O_WRONLY), 2)):
            os.dup2(old, new)
        os.closerange(3, 1024)  # among them the command's locks
        sys.stdin, sys.argv = open(0), ["publisher", step_back]  # noqa: SIM115
        publisher.main()

    def wait(self, timeout: float | None = None) -> None:
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("publisher", timeout or 0.0)

    def kill(self) -> None:
        self._process.kill()
