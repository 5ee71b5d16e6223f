"""Runs to be killed: the command ``fieldrl`` in a forked process, with a fault built in where one is wanted.

The parent imports everything once, so that a victim begins within milliseconds of its fork.
"""

from __future__ import annotations

import atexit
import errno
import functools
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fieldrl.pde.advection import Advection
from fieldrl.pde.advection_diffusion import AdvectionDiffusion

Fault = Callable[[], None]
"""Called in the victim before it begins; builds the fault in."""


@dataclass(frozen=True)
class Victim:
    """A running command.

    Args:
        pid: of its process, which leads a session of its own.
        folder: where it writes what it says.
    """

    pid: int
    folder: Path

    def kill(self, workers: bool = True) -> None:
        """SIGKILL to the process, and to its workers."""
        os.killpg(self.pid, signal.SIGKILL) if workers else os.kill(self.pid, signal.SIGKILL)

    def interrupt(self) -> None:
        """Ctrl-C: SIGINT to all of its session."""
        os.killpg(self.pid, signal.SIGINT)

    def wait(self) -> tuple[int, str, str]:
        """Exit status (negative: the signal that ended it), output and errors."""
        _, status = os.waitpid(self.pid, 0)
        output, errors = ((self.folder / f"{name}.txt").read_text() for name in ("output", "errors"))
        return os.waitstatus_to_exitcode(status), output, errors

    def workers(self) -> list[int]:
        """Its loky workers."""
        found = []
        for place in Path("/proc").glob("[0-9]*"):
            try:
                parent = int((place / "stat").read_text().rpartition(")")[2].split()[1])
                command = (place / "cmdline").read_text()
            except OSError:
                continue
            if parent == self.pid and "popen_loky" in command:
                found.append(int(place.name))
        return found


def start(folder: Path, arguments: Sequence[str], fault: Fault | None = None) -> Victim:
    """Start the command in ``folder``; checkpoints are written after every episode."""
    folder.mkdir(parents=True, exist_ok=True)
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        _be_victim(folder, arguments, fault)
    return Victim(pid, folder)


def run(folder: Path, arguments: Sequence[str], fault: Fault | None = None) -> tuple[int, str, str]:
    """Run the command to its end: exit status, output and errors."""
    return start(folder, arguments, fault).wait()


def _be_victim(folder: Path, arguments: Sequence[str], fault: Fault | None) -> None:
    from fieldrl.cli.main import main
    from fieldrl.runs import checkpoints, job

    os.environ["FIELDRL_PACKAGES"] = "pipelines"  # Slow, Unreliable
    os.setsid()
    os.chdir(folder)
    for number, name in ((1, "output"), (2, "errors")):
        os.dup2(os.open(folder / f"{name}.txt", os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
    sys.stdout, sys.stderr = (open(number, "w", buffering=1, closefd=False) for number in (1, 2))  # noqa: SIM115
    signal.signal(signal.SIGINT, signal.default_int_handler)
    checkpoints.SHARE = 1e9
    job.Checkpoints = functools.partial(checkpoints.Checkpoints, period=0.0)  # type: ignore[misc, assignment]
    if fault is not None:
        fault()
    status = 1
    try:
        status = main(list(arguments))
        threading._shutdown()  # type: ignore[attr-defined]  as the interpreter does before it ends
        atexit._run_exitfuncs()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


def killed_while_writing(name: str, moment: str, turn: int) -> None:
    """Be killed when a file or folder whose name begins with ``name`` is written for the ``turn``-th time.

    Args:
        name: "replicate-", "record.nc", "figures" or "summary.json".
        moment: "half" of it is written, "before" it takes its place, or "after".
        turn: from 0.
    """
    from fieldrl.runs import atomic

    move, left = atomic._replace, [turn]

    def replace(temporary: Path, path: Path) -> None:
        ours = path.name.startswith(name)
        left[0] -= ours
        if ours and left[0] < 0 and moment != "after":
            if moment == "half" and temporary.is_file():
                os.truncate(temporary, temporary.stat().st_size // 2)
            os.kill(os.getpid(), signal.SIGKILL)
        move(temporary, path)
        if ours and left[0] < 0:
            os.kill(os.getpid(), signal.SIGKILL)

    atomic._replace = replace  # type: ignore[assignment]


def failing_writes(code: int, after: int) -> None:
    """Have every file but the first ``after`` fail to take its place, with an error of the system."""
    from fieldrl.runs import atomic

    move, left = atomic._replace, [after]

    def replace(temporary: Path, path: Path) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(code, os.strerror(code))
        move(temporary, path)

    atomic._replace = replace  # type: ignore[assignment]


full_disk = functools.partial(failing_writes, errno.ENOSPC, 3)


def slow_episodes(seconds: float) -> None:
    """Have every episode take longer, so that there is time for something to happen to it."""
    from fieldrl.mission.learning import Replicate

    advance = Replicate.advance

    def slowly(self: Replicate) -> None:
        time.sleep(seconds)
        advance(self)

    Replicate.advance = slowly  # type: ignore[method-assign]


class Slow(Advection):
    """The first experiment with samples that take their time, in every process that has them."""

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """As the model's, later."""
        time.sleep(0.01)
        return super().predict(theta, positions, times)


class Unreliable(AdvectionDiffusion):
    """The second experiment with a solver that gives no number for one theta in four."""

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """As the solver's, NaN where it fails."""
        found = super().predict(theta, positions, times)
        digits = np.floor(np.abs(np.atleast_2d(theta)).sum(axis=1) * 1e6).astype(np.int64)
        found[digits % 4 == 0] = np.nan
        return found
