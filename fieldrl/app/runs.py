"""A run is its configuration: the same results have the same key and the same folder.

``outputs/runs/<experiment>-<key>/`` holds ``.hydra/``, ``record.nc``, ``figures/`` and, written last,
``summary.json``, whose existence says that the run is finished. Every file is written beside its place
and moved there when it is complete, so that neither a kill nor a full disk destroys what was finished.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from fieldrl.core.checks import FieldrlError, InvalidValue

RESULTS = 1
"""Version of the results: raise it when the same configuration gives other numbers than before."""

WITHOUT_EFFECT = ("output_dir", "force", "parallel", "tracking")
"""Keys that cannot change a result, and so are no part of a run's identity."""


def identity(config: Mapping[str, Any]) -> str:
    """The key of a configuration: ten hexadecimal digits of its hash."""
    effective = {key: value for key, value in config.items() if key not in WITHOUT_EFFECT}
    text = json.dumps([RESULTS, _canonical(effective)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:10]


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
        """The result of a finished run; None where it is not finished or its summary is garbled."""
        try:
            summary = json.loads((self.folder / "summary.json").read_text())
        except (OSError, ValueError):
            return None
        complete = isinstance(summary, dict) and summary.get("finished") and summary.get("key") == self.key
        return summary if complete and (self.folder / "record.nc").exists() else None

    def write(self, name: str, writer: Callable[[Path], Any]) -> Path:
        """Let ``writer`` write a file or fill a folder beside its place, then move it there."""
        return write(self.folder / name, writer)

    @contextmanager
    def held(self, waiting: Callable[[], Any]) -> Iterator[bool]:
        """Hold the run, so that no other process computes it.

        Yields:
            Whether another process held it; ``waiting`` is called before waiting for that.
        """
        lock = FileLock(make_folder(self.output_dir / ".locks") / f"{self.name}.lock")
        waited = False
        try:
            lock.acquire(timeout=0)
        except Timeout:
            waited = True
            waiting()
            lock.acquire()
        try:
            yield waited
        finally:
            lock.release()


def make_folder(path: Path) -> Path:
    """Make a folder and its parents; says which key to change where that is impossible."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        rule = f"cannot be written ({error.strerror})"
        raise InvalidValue("output_dir", str(path), rule, remedy="choose another with output_dir=FOLDER") from error
    return path


def write(path: Path, writer: Callable[[Path], Any]) -> Path:
    """Let ``writer`` write a file or folder at a temporary path, then move it to ``path``.

    Raises:
        FieldrlError: the disk is full or the folder cannot be written; what stood at ``path`` still does.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        writer(temporary)
        _replace(temporary, path)
    except OSError as error:
        reason = error.strerror or _first_line(error)
        raise FieldrlError(
            f"{path}: cannot be written ({reason}); finished runs are untouched.\n"
            "Free some space or choose another place with output_dir=FOLDER, then repeat the command."
        ) from error
    finally:
        _remove(temporary)
    return path


def _replace(temporary: Path, path: Path) -> None:
    """Move a complete file or folder to its place; a folder that stands there makes way first."""
    if temporary.is_dir() and path.is_dir():
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as aside:
            os.replace(path, Path(aside) / "old")
            os.replace(temporary, path)
    else:
        os.replace(temporary, path)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _first_line(error: BaseException) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
