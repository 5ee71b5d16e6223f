"""Which runs an output folder holds, finished or not."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import Timeout

from fieldrl.core.checks import FieldrlError
from fieldrl.runs.folder import Run, json_of, text
from fieldrl.runs.title import changes, command, overrides_of, title


@dataclass(frozen=True)
class Found:
    """A run on disk.

    Args:
        run: its identity and place.
        summary: the result; empty where it is not finished.
        overrides: what it was asked for with.
    """

    run: Run
    summary: Mapping[str, Any]
    overrides: tuple[str, ...]

    @property
    def title(self) -> str:
        """What people call it."""
        return title(self.run.experiment, changes(self.overrides))

    @property
    def command(self) -> str:
        """What repeats it."""
        return command(self.run.experiment, self.overrides)


def runs(output_dir: Path) -> list[Found]:
    """Every run of an output folder, the one that was touched last first."""
    folders = [path for path in (output_dir / Run.kind).glob("*-*") if path.is_dir()]
    return [_found(path, output_dir) for path in sorted(folders, key=_touched, reverse=True)]


def named(names: Sequence[str], output_dir: Path) -> list[Found]:
    """The runs of these names: a name, a key, the beginning of one, or a folder.

    Raises:
        FieldrlError: there is none, or several begin alike.
    """
    known = runs(output_dir)
    return [_one(name, known, output_dir) for name in names]


def sweep(name: str, output_dir: Path) -> Path | None:
    """The folder of the sweep of this name, key, or the beginning of one; None where there is not one."""
    wanted = Path(name).name
    folders = [path for path in (output_dir / "sweeps").glob("*-sweep-*") if path.is_dir()]
    found = [
        path
        for path in folders
        if path.name.startswith(wanted) or path.name.rpartition("-")[2].startswith(wanted)
    ]
    return found[0] if len(found) == 1 else None


def jobs(folder: Path) -> list[str]:
    """The names of the runs of a sweep that are finished, from its table."""
    try:
        with (folder / "results.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
    except OSError:
        return []
    return list(
        dict.fromkeys(row["run"] for row in rows if row.get("status") == "finished" and row.get("run"))
    )


def held(run: Run) -> bool:
    """Whether a process works on a run."""
    try:
        with run.lock.acquire(timeout=0):
            return False
    except Timeout:
        return True


def remove(run: Run) -> bool:
    """Remove a run's folder, unless a process works on it; whether it was removed."""
    try:
        with run.lock.acquire(timeout=0):
            shutil.rmtree(run.folder)
    except Timeout:
        return False
    return True


def _one(name: str, known: Sequence[Found], output_dir: Path) -> Found:
    wanted = Path(name).name
    tests: tuple[Callable[[Run], bool], ...] = (
        lambda run: wanted in (run.name, run.key),
        lambda run: run.name.startswith(wanted) or run.key.startswith(wanted),
    )
    for test in tests:
        matching = [found for found in known if test(found.run)]
        if len(matching) == 1:
            return matching[0]
        if matching:
            names = ", ".join(found.run.name for found in matching[:3])
            raise FieldrlError(f"{name}: {len(matching)} runs begin so ({names}, ...); give more of its key")
    raise FieldrlError(f"{name}: no such run in {output_dir}; fieldrl list shows them")


def _found(folder: Path, output_dir: Path) -> Found:
    experiment, _, key = folder.name.rpartition("-")
    summary = json_of(folder / "summary.json")
    finished = summary.get("finished") and summary.get("key") == key
    overrides = overrides_of(text(folder / ".hydra" / "overrides.yaml"))
    return Found(Run(experiment, key, output_dir), summary if finished else {}, overrides)


def _touched(folder: Path) -> float:
    return folder.stat().st_mtime
