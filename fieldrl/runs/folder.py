"""What runs and sweeps have in common: a key, a folder, whole files, one process at a time.

``outputs/runs/<experiment>-<key>/`` holds ``.hydra/``, ``record.nc``, ``figures/`` and, written last,
``summary.json``, whose existence says that the run is finished.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from filelock import FileLock, Timeout

from fieldrl.core.checks import InvalidValue
from fieldrl.runs import atomic

if TYPE_CHECKING:
    import xarray as xr

_TRACKED = "tracking.json"


@dataclass(frozen=True)
class ResultFolder:
    """A run or a sweep, and its place on disk.

    Args:
        experiment: name of the experiment (of the first job, where those of a sweep differ).
        key: identity of its configuration.
        output_dir: absolute folder of everything that is written.
    """

    experiment: str
    key: str
    output_dir: Path

    kind: ClassVar[str]
    """The folder below ``output_dir``."""

    @property
    def name(self) -> str:
        """<experiment>-<key>."""
        return f"{self.experiment}-{self.key}"

    @property
    def folder(self) -> Path:
        """Where its files are."""
        return self.output_dir / self.kind / self.name

    def write(self, name: str, content: str | bytes | Callable[[Path], Any]) -> Path:
        """Write a file or folder of it, complete or not at all; see ``atomic.write``."""
        return atomic.write(self.folder / name, content)

    @property
    def lock(self) -> FileLock:
        """The lock of who works on it.

        Raises:
            InvalidValue: the output folder cannot be written.
        """
        return FileLock(lock_folder(self.output_dir) / f"{self.name}.lock")

    @contextmanager
    def held(self, waiting: Callable[[str, str], Any]) -> Iterator[bool]:
        """Hold it, so that no other process works on it.

        Args:
            waiting: told its name and who holds it ("process 7 on host", or nothing), before waiting.

        Yields:
            Whether another process held it.

        Raises:
            InvalidValue: the output folder cannot be written.
        """
        lock, waited = self.lock, False
        holder = Path(lock.lock_file).with_suffix(".holder")
        try:
            lock.acquire(timeout=0)
        except Timeout:
            waited = True
            waiting(self.name, text(holder))
            lock.acquire()
        try:
            with suppress(OSError):
                holder.write_text(f"process {os.getpid()} on {platform.node()}")
            yield waited
        finally:
            holder.unlink(missing_ok=True)
            lock.release()


VARIES = "seconds", "record_file"
"""What summaries of equal results may differ in: HDF5 notes when it made a file."""


class Run(ResultFolder):
    """A run and its place on disk."""

    kind = "runs"

    def summary(self) -> dict[str, Any] | None:
        """The result of a finished run; None where there is none, or one of its files is damaged."""
        summary = json_of(self.folder / "summary.json")
        complete = summary.get("finished") and summary.get("key") == self.key
        digest = self._record_digest() if complete else ""
        if not digest:
            return None
        if summary.get("record_file", digest) != digest:
            warnings.warn(f"{self.folder / 'record.nc'}: is damaged; the run is done again", stacklevel=2)
            return None
        return summary

    def checksums(self, record: xr.Dataset) -> dict[str, str]:
        """Of the record's numbers and of its file, for the summary."""
        from fieldrl.runs import netcdf

        return {"record": netcdf.checksum(record), "record_file": self._record_digest()}

    def _record_digest(self) -> str:
        """Of the record's file; empty where there is none."""
        try:
            return hashlib.blake2b((self.folder / "record.nc").read_bytes(), digest_size=16).hexdigest()
        except OSError:
            return ""

    def tidy(self) -> None:
        """Remove what a killed process left half written; only for who holds the run."""
        for path in self.folder.glob(".*.tmp"):
            atomic.remove(path)


def tracked(folder: Path) -> dict[str, Any]:
    """Where the run or sweep in a folder is in MLflow; empty where it is not."""
    return json_of(folder / _TRACKED)


def note_tracked(folder: Path, content: Mapping[str, Any]) -> None:
    """Keep where the run or sweep in a folder is in MLflow."""
    atomic.write(folder / _TRACKED, json.dumps(content) + "\n")


def json_of(path: Path) -> dict[str, Any]:
    """The object in a JSON file; empty where there is none or it is damaged."""
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def lock_folder(output_dir: Path) -> Path:
    """The folder of the lock files, made where it is missing.

    Raises:
        InvalidValue: it cannot be made.
    """
    folder = output_dir / ".locks"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        rule, remedy = f"cannot be written ({error.strerror})", "choose another folder"
        raise InvalidValue("output_dir", str(output_dir), rule, remedy=remedy) from error
    return folder


def text(path: Path) -> str:
    """What a small file says; nothing where it cannot be read."""
    try:
        return path.read_text()
    except OSError:
        return ""
