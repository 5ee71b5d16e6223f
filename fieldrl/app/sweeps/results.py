"""The table of a sweep: a row for each job, as CSV and for the terminal."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fieldrl.app.sweeps.objective import Objective

NUMBERS = ("e_f", "e_cv", "e_total", "theta_error", "field_rmse", "forward_solves", "seconds")


@dataclass(frozen=True)
class Row:
    """What became of one job.

    Args:
        number: of the job, from 0.
        overrides: KEY=VALUE of every override.
        varied: the values that this sweep varies, by key, as text.
        key: identity of the run; "" where its configuration could not be composed.
        name: of the run.
        folder: of the run.
        summary: of the finished run; empty where it failed.
        value: the objective's; None where there is none.
        values: the numbers that ``value`` is the median of.
        reason: why it failed; "" where it finished.
        reused: whether the run was finished before.
    """

    number: int
    overrides: tuple[str, ...]
    varied: Mapping[str, str]
    key: str = ""
    name: str = ""
    folder: Path | None = None
    summary: Mapping[str, Any] = field(default_factory=dict)
    value: float | None = None
    values: tuple[float, ...] = ()
    reason: str = ""
    reused: bool = False

    @property
    def label(self) -> str:
        """The varied values as one text."""
        return " ".join(f"{key}={value}" for key, value in self.varied.items()) or self.name


def best(rows: Sequence[Row], objective: Objective) -> Row | None:
    """The job with the best value; None where no job has one."""
    return next(iter(ranked(rows, objective)), None)


def ranked(rows: Sequence[Row], objective: Objective) -> list[Row]:
    """The jobs that have a value, best first."""
    valued = [(objective.loss(row.value), row.number, row) for row in rows if row.value is not None]
    return [row for *_, row in sorted(valued, key=lambda item: item[:2])]


def write_csv(rows: Sequence[Row], objective: Objective, path: Path) -> None:
    """One line for each job: its varied values, its results, and why it failed where it did."""
    varied = list(dict.fromkeys(key for row in rows for key in row.varied))
    names = tuple(dict.fromkeys((objective.path, *NUMBERS)))
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["job", *varied, "status", *names, "run", "reason"])
        for row in rows:
            numbers = {objective.path: row.value} | {name: row.summary.get(name) for name in NUMBERS}
            writer.writerow(
                [
                    row.number,
                    *(row.varied.get(key, "") for key in varied),
                    "failed" if row.reason else "finished",
                    *("" if numbers[name] is None else numbers[name] for name in names),
                    row.name,
                    " ".join(row.reason.split()),
                ]
            )
