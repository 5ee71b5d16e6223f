"""Where faults are tried out: folders, references that nothing happened to, and what was seen."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from fieldrl.runs.folder import VARIES
from pipelines.faults import victims


@dataclass
class Outcome:
    """What was seen of one case.

    Args:
        same: how many results equal the reference bit for bit.
        differ: how many do not, or are not there.
        lost: finished runs or replicates that were lost.
        lines: most lines of error that a user saw at once.
        said: one of them.
    """

    same: int = 0
    differ: int = 0
    lost: int = 0
    lines: int = 0
    said: str = ""
    trouble: list[str] = field(default_factory=list)

    def saw(self, text: str) -> None:
        """A user saw this."""
        lines = [line for line in text.strip().splitlines() if line.strip()]
        if len(lines) > self.lines:
            self.lines, self.said = len(lines), " / ".join(lines)

    def compare(self, equal: bool, trouble: str) -> None:
        """Count one comparison with a reference."""
        self.same += equal
        self.expect(equal, trouble)

    def expect(self, holds: bool, trouble: str) -> None:
        """Count what is not as it must be."""
        if not holds:
            self.differ += 1
            self.trouble.append(trouble)


class Bench:
    """Where the cases happen.

    Args:
        folder: for everything that is written.
        seed: of the random moments.
    """

    def __init__(self, folder: Path, seed: int = 0) -> None:
        self.folder, self.rng = folder, np.random.default_rng(seed)
        self._references: dict[tuple[str, ...], tuple[dict[str, Any], float]] = {}
        self._places = 0

    def place(self) -> Path:
        """A new folder."""
        self._places += 1
        return self.folder / f"place-{self._places}"

    def reference(self, arguments: Sequence[str]) -> dict[str, Any]:
        """The results of a command that nothing happens to; worker processes change none."""
        alone = ["parallel=serial" if each == "parallel.jobs=2" else each for each in arguments]
        return self._reference(alone)[0]

    def moment(self, arguments: Sequence[str]) -> float:
        """A random time within the command [s]."""
        return float(self.rng.uniform(0.0, self._reference(arguments)[1]))

    def again(self, folder: Path, arguments: Sequence[str], outcome: Outcome) -> tuple[int, str, str]:
        """The same command once more; its result must be the reference's."""
        status, output, errors = victims.run(folder, arguments)
        outcome.saw(errors)
        equal = status == 0 and same(results(folder), self.reference(arguments))
        outcome.compare(equal, f"{folder}: {status} {errors}")
        left = list(folder.glob("outputs/runs/*/checkpoints")) + list(folder.glob("outputs/runs/*/.*.tmp"))
        outcome.expect(not left, f"left behind: {left}")
        if equal:
            shutil.rmtree(folder, ignore_errors=True)
        return status, output, errors

    def _reference(self, arguments: Sequence[str]) -> tuple[dict[str, Any], float]:
        key = tuple(arguments)
        if key not in self._references:
            place, started = self.place(), time.monotonic()
            status, _, errors = victims.run(place, arguments)
            if status:
                raise RuntimeError(f"the reference of {' '.join(arguments)} failed: {errors}")
            self._references[key] = results(place), time.monotonic() - started
        return self._references[key]


def results(folder: Path) -> dict[str, Any]:
    """Record and summary of every finished run in a folder, by name."""
    found = {}
    for path in folder.glob("outputs/runs/*/summary.json"):
        summary = json.loads(path.read_text()) | dict.fromkeys(VARIES)
        found[path.parent.name] = xr.load_dataset(path.parent / "record.nc", engine="netcdf4"), summary
    return found


def same(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether results are equal bit for bit."""
    return one.keys() == other.keys() and all(
        one[name][0].identical(other[name][0]) and one[name][1] == other[name][1] for name in one
    )
