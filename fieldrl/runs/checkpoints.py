"""Replicates of a run that is being computed, kept on disk between two episodes.

Each replicate has a file of its own, written by the process that computes it: a line of JSON that says
what it is, then the arrays. The file before it is kept, so that a damaged one costs no more than the time
between two. Everything is gone once the run is finished.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import shutil
import time
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fieldrl import __version__
from fieldrl.core.checks import FieldrlError
from fieldrl.runs import atomic
from fieldrl.runs.identity import RESULTS

if TYPE_CHECKING:
    from fieldrl.mission.learning import Replicate

SHARE = 0.02
"""Most of its time that a replicate spends on checkpoints."""

_LAYOUT = 2  # of the file: one written in another is left out
_ARRAY = "array number"


class Kept(NamedTuple):
    """A checkpoint that is whole.

    Args:
        state: of the replicate.
        episodes: how many were done.
        seconds: how long the run had been computed.
    """

    state: dict[str, Any]
    episodes: int
    seconds: float


@dataclass(frozen=True)
class Checkpoints:
    """The checkpoints of one run.

    Args:
        folder: where they are.
        key: of the run.
        period: least time between two checkpoints of a replicate [s].
    """

    folder: Path
    key: str
    period: float = 2.0

    @property
    def solves(self) -> Path:
        """Where solves already paid for are kept as long."""
        return self.folder / "solves"

    def write(self, number: int, replicate: Replicate, seconds: float) -> None:
        """Keep the state of replicate ``number``; the checkpoint before it is kept too.

        Raises:
            FieldrlError: the disk is full or cannot be written; what was there still is.
        """
        latest, before = self._paths(number)
        head = self._head(number) | {"episodes": replicate.episodes, "seconds": round(seconds, 3)}
        content = _encode(head, replicate.state())

        def save(path: Path) -> None:
            _write_through(path, content)
            with suppress(FileNotFoundError):
                os.replace(latest, before)

        atomic.write(latest, save)

    def read(self, number: int) -> Kept | None:
        """The newest whole checkpoint of a replicate; None where there is none."""
        for path in self._paths(number):
            kept = self._kept(path, number)
            if kept is not None:
                return kept
        return None

    def survey(self, replicates: int) -> dict[int, Kept]:
        """The newest whole checkpoint of each replicate that has one; warns of those that are damaged."""
        found: dict[int, Kept] = {}
        for number in range(replicates):
            for path in reversed(self._paths(number)):
                kept = self._kept(path, number)
                if kept is not None:
                    found[number] = kept
                elif path.exists():
                    warnings.warn(f"{path}: is damaged and is left out", stacklevel=2)
                    path.unlink()
        return found

    def remove(self) -> None:
        """Forget everything."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _paths(self, number: int) -> tuple[Path, Path]:
        """The latest checkpoint of a replicate and the one before."""
        return self.folder / f"replicate-{number}", self.folder / f"replicate-{number}-before"

    def _head(self, number: int) -> dict[str, Any]:
        """What a checkpoint must say to be taken."""
        versions = {"layout": _LAYOUT, "results": RESULTS, "version": __version__}
        return {"key": self.key, "replicate": number, **versions}

    def _kept(self, path: Path, number: int) -> Kept | None:
        try:
            head, state = _decode(path.read_bytes())
        except (OSError, ValueError):
            return None
        ours = head.items() >= self._head(number).items()
        return Kept(state, head["episodes"], head["seconds"]) if ours else None


class Keeper:
    """Writes a replicate's checkpoints: not too often, at its end in any case.

    Args:
        checkpoints: of the run.
        number: of the replicate.
        begun: when the run would have begun, had it never been interrupted [s since the epoch].
    """

    def __init__(self, checkpoints: Checkpoints, number: int, begun: float) -> None:
        self.checkpoints, self.number, self.begun = checkpoints, number, begun
        self.due = time.monotonic() + checkpoints.period

    def __call__(self, replicate: Replicate) -> None:
        """Called between two episodes; a checkpoint that cannot be written is no reason to stop."""
        started = time.monotonic()
        if started < self.due and not replicate.finished:
            return
        try:
            self.checkpoints.write(self.number, replicate, time.time() - self.begun)
        except FieldrlError as error:
            reason = getattr(error.__cause__, "strerror", None) or error.__cause__
            warnings.warn(
                f"{self.checkpoints.folder}: no checkpoint could be written ({reason})", stacklevel=2
            )
        took = time.monotonic() - started
        self.due = started + took + max(self.checkpoints.period, took / SHARE)


def _encode(head: Mapping[str, Any], state: Mapping[str, Any]) -> bytes:
    """A line that says what it is and its digest, a line of JSON that refers to arrays, and the arrays."""
    arrays: list[np.ndarray] = []

    def refer(value: Any) -> dict[str, int]:
        if not isinstance(value, np.ndarray):
            raise TypeError(f"{type(value).__name__} in the state of a replicate")
        arrays.append(value)
        return {_ARRAY: len(arrays) - 1}

    text, buffer = json.dumps(state, default=refer), io.BytesIO()
    np.savez(buffer, *arrays)
    body = text.encode() + b"\n" + buffer.getvalue()
    return json.dumps({**head, "digest": _digest(body)}).encode() + b"\n" + body


def _decode(content: bytes) -> tuple[dict[str, Any], dict[str, Any]]:
    """Head and state; raises ValueError where the content is damaged."""
    first, _, body = content.partition(b"\n")
    head = json.loads(first)
    if not isinstance(head, dict) or head.get("digest") != _digest(body):
        raise ValueError("the digest does not fit")
    text, _, arrays = body.partition(b"\n")
    with np.load(io.BytesIO(arrays), allow_pickle=False) as found:

        def resolve(part: dict[str, Any]) -> Any:
            return found[f"arr_{part[_ARRAY]}"] if part.keys() == {_ARRAY} else part

        return head, json.loads(text, object_hook=resolve)


def _digest(body: bytes) -> str:
    return hashlib.blake2b(body, digest_size=16).hexdigest()


def _write_through(path: Path, content: bytes) -> None:
    """Write a file and wait until the disk has it, so that a power failure cannot leave half of it."""
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
