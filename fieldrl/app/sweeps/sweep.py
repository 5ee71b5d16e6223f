"""A sweep is its overrides: the same command has the same key, the same folder, the same MLflow parent."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from fieldrl.app import files, runs
from fieldrl.core.checks import InvalidValue


def identity(arguments: Sequence[str], method: Mapping[str, Any]) -> str:
    """The key of a sweep: ten hexadecimal digits of a hash.

    Args:
        arguments: overrides as typed, in any order; those that cannot change a result do not count.
        method: settings of the sweeper that decide which jobs there are.
    """
    effective = sorted(text for text in arguments if _group(text) not in runs.WITHOUT_EFFECT)
    text = json.dumps([runs.RESULTS, effective, dict(method)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:10]


def _group(override: str) -> str:
    """``agent`` of "+agent.step_size=0.5"."""
    return override.partition("=")[0].lstrip("+~").partition(".")[0]


@dataclass(frozen=True)
class Sweep:
    """A sweep and its place on disk.

    Args:
        experiment: name of the experiment (of the first job, where they differ).
        key: identity.
        output_dir: absolute folder of everything that runs write.
        arguments: the overrides as typed.
    """

    experiment: str
    key: str
    output_dir: Path
    arguments: tuple[str, ...]

    @property
    def name(self) -> str:
        """<experiment>-sweep-<key>."""
        return f"{self.experiment}-sweep-{self.key}"

    @property
    def folder(self) -> Path:
        """Where the table, the pictures and the state of the sweep are."""
        return self.output_dir / "sweeps" / self.name

    def write(self, name: str, writer: Callable[[Path], Any]) -> Path:
        """Write a file or folder of the sweep, atomically; see ``files.write``."""
        return files.write(self.folder / name, writer)

    @contextmanager
    def held(self, waiting: Callable[[], Any]) -> Iterator[None]:
        """Hold the sweep, so that no other process conducts it.

        Args:
            waiting: called before waiting for another process that does.

        Raises:
            InvalidValue: the output folder cannot be written.
        """
        locks = self.output_dir / ".locks"
        try:
            locks.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            rule, remedy = f"cannot be written ({error.strerror})", "choose another folder"
            raise InvalidValue("output_dir", str(self.output_dir), rule, remedy=remedy) from error
        lock = FileLock(locks / f"{self.name}.lock")
        try:
            lock.acquire(timeout=0)
        except Timeout:
            waiting()
            lock.acquire()
        try:
            yield
        finally:
            lock.release()
