"""A sweep is its overrides: the same command has the same key, the same folder, the same MLflow parent."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fieldrl.app import files, locks, runs


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

    def held(self, waiting: Callable[[str], Any]) -> AbstractContextManager[bool]:
        """Hold the sweep, so that no other process conducts it; see ``locks.held``."""
        return locks.held(self.output_dir, self.name, waiting)
