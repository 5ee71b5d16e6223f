"""Solves already paid for: a memo by everything that a solve depends on, in memory, then on disk.

The store never changes a result by a bit: arrays are kept in full precision, and what cannot be read back
intact is computed again. It does not say which solves an estimator may know (that is the estimator's state).
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import math
import os
import pickle
import tempfile
import threading
import uuid
import warnings
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component

_MEGABYTE = 2**20
_DIGEST = 16
_UNSEEN = 1 / 64  # of the limit on disk may be written before the folder is looked through
_SUFFIX = ".solution"


def key(*parts: Any) -> str:
    """A name for everything that ``parts`` hold: equal contents, equal key, in every process.

    Dataclasses count by class and fields, arrays by contents, other objects by their pickle; what has none
    gets a key of its own, so it is never taken for something else.
    """
    digest = hashlib.blake2b(digest_size=20)
    for part in parts:
        digest.update(_describe(part))
        digest.update(b"|")
    return digest.hexdigest()


def _describe(part: Any) -> bytes:
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        kind = type(part)
        fields = ((f.name, getattr(part, f.name)) for f in dataclasses.fields(part))
        return f"{kind.__module__}.{kind.__qualname__}".encode() + _describe(tuple(fields))
    if isinstance(part, np.ndarray):
        return f"{part.dtype.str}{part.shape}".encode() + np.ascontiguousarray(part).tobytes()
    if isinstance(part, tuple | list):
        return b"(" + b",".join(_describe(item) for item in part) + b")"
    if part is None or isinstance(part, bool | int | float | str):
        return repr(part).encode()
    try:
        return pickle.dumps(part)
    except (pickle.PicklingError, TypeError, AttributeError):
        return uuid.uuid4().bytes


@component
class Solutions:
    """A store of arrays by key.

    Safe for several threads and processes; pickled, it keeps its settings and forgets its contents.

    Args:
        memory: most that is kept in memory; the least recently used go first [MB].
        directory: where solves are kept across runs and processes, or None for memory only.
        disk: most that is kept in the directory [MB].
    """

    memory: float = 512.0
    directory: str | os.PathLike[str] | None = None
    disk: float = 4096.0

    def __post_init__(self) -> None:
        checks.not_negative("memory", self.memory, "MB")
        checks.not_negative("disk", self.disk, "MB")
        self._forget()

    def __getstate__(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            object.__setattr__(self, name, value)
        self._forget()

    def _forget(self) -> None:
        object.__setattr__(self, "_shelf", _Shelf())

    @property
    def solves(self) -> int:
        """How many solves were really computed through this store in this process."""
        return self._shelf.solves  # type: ignore[attr-defined]

    @property
    def size(self) -> int:
        """Bytes held in memory."""
        return self._shelf.size  # type: ignore[attr-defined]

    def get(self, name: str, compute: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
        """The array called ``name``: from memory, else from disk, else computed and kept. Read-only."""
        shelf: _Shelf = self._shelf  # type: ignore[attr-defined]
        kept = shelf.take(name)
        if kept is None:
            kept = self._from_disk(name)
            if kept is None:
                kept = np.ascontiguousarray(compute())
                shelf.count()
                self._to_disk(name, kept)
            kept.setflags(write=False)
            shelf.put(name, kept, self.memory * _MEGABYTE)
        return kept

    def _path(self, name: str) -> Path:
        return Path(str(self.directory)) / (name + _SUFFIX)

    def _from_disk(self, name: str) -> NDArray[np.float64] | None:
        if self.directory is None:
            return None
        try:
            data = self._path(name).read_bytes()
            if _checksum(data[_DIGEST:]) != data[:_DIGEST]:
                return None
            os.utime(self._path(name))
            return np.load(io.BytesIO(data[_DIGEST:]), allow_pickle=False)
        except (OSError, ValueError, EOFError):
            return None

    def _to_disk(self, name: str, array: NDArray[np.float64]) -> None:
        """Written beside its place and moved there whole, so that readers never see half an entry."""
        if self.directory is None or array.nbytes > self.disk * _MEGABYTE:
            return
        buffer = io.BytesIO()
        np.save(buffer, array, allow_pickle=False)
        try:
            _write(self._path(name), _checksum(buffer.getvalue()) + buffer.getvalue())
            if self._shelf.is_full(array.nbytes, self.disk * _MEGABYTE):  # type: ignore[attr-defined]
                _trim(self._path(name).parent, self.disk * _MEGABYTE)
        except OSError as error:
            warnings.warn(f"solutions.directory={self.directory}: {error}; solves are not kept", stacklevel=2)


class _Shelf:
    """What a store holds in memory."""

    def __init__(self) -> None:
        self.arrays: OrderedDict[str, NDArray[np.float64]] = OrderedDict()
        self.size, self.solves, self.lock = 0, 0, threading.Lock()
        self.written = math.inf

    def take(self, name: str) -> NDArray[np.float64] | None:
        with self.lock:
            if name in self.arrays:
                self.arrays.move_to_end(name)
            return self.arrays.get(name)

    def count(self) -> None:
        with self.lock:
            self.solves += 1

    def is_full(self, size: int, limit: float) -> bool:
        """Whether so much was written since the folder was last looked through that it is time to do so."""
        with self.lock:
            self.written += size
            due = self.written > _UNSEEN * limit
            if due:
                self.written = 0.0
            return due

    def put(self, name: str, array: NDArray[np.float64], limit: float) -> None:
        with self.lock:
            if name in self.arrays or array.nbytes > limit:
                return
            self.arrays[name] = array
            self.size += array.nbytes
            while self.size > limit:
                self.size -= self.arrays.popitem(last=False)[1].nbytes


def _checksum(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=_DIGEST).digest()


def _write(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _trim(folder: Path, limit: float) -> None:
    """Delete the least recently used entries until the folder holds at most ``limit`` bytes."""
    entries = []
    for entry in os.scandir(folder):
        try:
            if entry.name.endswith(_SUFFIX):
                entries.append((entry.stat().st_mtime_ns, entry.stat().st_size, entry.path))
        except FileNotFoundError:  # another process deleted it
            continue
    excess = sum(size for _, size, _ in entries) - limit
    for _, size, path in sorted(entries):
        if excess <= 0:
            break
        Path(path).unlink(missing_ok=True)
        excess -= size
