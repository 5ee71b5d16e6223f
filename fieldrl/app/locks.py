"""Runs and sweeps that only one process at a time may work on."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from fieldrl.core.checks import InvalidValue


@contextmanager
def held(output_dir: Path, name: str, waiting: Callable[[str], Any]) -> Iterator[bool]:
    """Hold what is called ``name`` in an output folder, so that no other process works on it.

    Args:
        output_dir: absolute folder of everything that runs write.
        name: of a run or a sweep.
        waiting: told who holds it ("process 7 on host", or nothing), before waiting for that.

    Yields:
        Whether another process held it.

    Raises:
        InvalidValue: the output folder cannot be written.
    """
    folder = _folder(output_dir)
    lock, holder, waited = FileLock(folder / f"{name}.lock"), folder / f"{name}.holder", False
    try:
        lock.acquire(timeout=0)
    except Timeout:
        waited = True
        waiting(_text(holder))
        lock.acquire()
    try:
        with suppress(OSError):
            holder.write_text(f"process {os.getpid()} on {platform.node()}")
        yield waited
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


def _folder(output_dir: Path) -> Path:
    """The folder of the lock files, made where it is missing."""
    folder = output_dir / ".locks"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        rule, remedy = f"cannot be written ({error.strerror})", "choose another folder"
        raise InvalidValue("output_dir", str(output_dir), rule, remedy=remedy) from error
    return folder


def _text(path: Path) -> str:
    """What a small file says; nothing where it cannot be read."""
    try:
        return path.read_text()
    except OSError:
        return ""
