"""A run is its configuration: the same results have the same key and the same folder.

``outputs/runs/<experiment>-<key>/`` holds ``.hydra/``, ``record.nc``, ``figures/`` and, written last,
``summary.json``, whose existence says that the run is finished.
"""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fieldrl.app import files, locks

RESULTS = 2
"""Version of the results: raise it when the same configuration gives other numbers than before."""

WITHOUT_EFFECT = ("output_dir", "force", "parallel", "tracking", "pde.solutions", "estimator.workers")
"""Keys that cannot change a result, and so are no part of a run's identity."""


def identity(config: Mapping[str, Any]) -> str:
    """The key of a configuration: ten hexadecimal digits of its hash."""
    text = json.dumps([RESULTS, _canonical(_effective(config))], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:10]


def _effective(config: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """The nested keys of ``config`` that can change a result."""
    found = {key: value for key, value in config.items() if f"{path}{key}" not in WITHOUT_EFFECT}
    return {
        key: _effective(value, f"{path}{key}.") if isinstance(value, Mapping) else value
        for key, value in found.items()
    }


def _canonical(value: Any) -> Any:
    """``value`` with 10.0 and 10 made equal."""
    if isinstance(value, Mapping):
        return {str(key): _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value


@dataclass(frozen=True)
class Run:
    """A run and its place on disk.

    Args:
        experiment: name of the experiment.
        key: identity of its configuration.
        output_dir: absolute folder of everything that runs write.
    """

    experiment: str
    key: str
    output_dir: Path

    @property
    def name(self) -> str:
        """<experiment>-<key>."""
        return f"{self.experiment}-{self.key}"

    @property
    def folder(self) -> Path:
        """Where the run's files are."""
        return self.output_dir / "runs" / self.name

    def summary(self) -> dict[str, Any] | None:
        """The result of a finished run; None where there is none, or one of its files is damaged."""
        try:
            summary = json.loads((self.folder / "summary.json").read_text())
        except (OSError, ValueError):
            return None
        complete = isinstance(summary, dict) and summary.get("finished") and summary.get("key") == self.key
        digest = self.record_digest() if complete else ""
        if not digest:
            return None
        if summary.get("record", digest) != digest:
            warnings.warn(f"{self.folder / 'record.nc'}: is damaged; the run is done again", stacklevel=2)
            return None
        return summary

    def record_digest(self) -> str:
        """Of the record's file; empty where there is none."""
        try:
            return hashlib.blake2b((self.folder / "record.nc").read_bytes(), digest_size=16).hexdigest()
        except OSError:
            return ""

    def write(self, name: str, writer: Callable[[Path], Any]) -> Path:
        """Write a file or folder of the run, atomically; see ``files.write``."""
        return files.write(self.folder / name, writer)

    def held(self, waiting: Callable[[str], Any]) -> AbstractContextManager[bool]:
        """Hold the run, so that no other process computes it; see ``locks.held``."""
        return locks.held(self.output_dir, self.name, waiting)

    def tidy(self) -> None:
        """Remove what a killed process left half written; only for who holds the run."""
        for path in self.folder.glob(".*.tmp"):
            files.remove(path)
