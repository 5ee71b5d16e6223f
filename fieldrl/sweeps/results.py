"""The table of a sweep: its jobs, best first, and as CSV."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from fieldrl.sweeps.objective import Objective
from fieldrl.sweeps.sweep_job import SweepJob

NUMBERS = ("e_f", "e_cv", "e_total", "theta_error", "field_rmse", "forward_solves", "seconds")


def ranked(jobs: Sequence[SweepJob], objective: Objective) -> list[SweepJob]:
    """The jobs that have a value, best first."""
    valued = [(objective.loss(job.value), job.number, job) for job in jobs if job.value is not None]
    return [job for *_, job in sorted(valued, key=lambda item: item[:2])]


def best(jobs: Sequence[SweepJob], objective: Objective) -> SweepJob | None:
    """The job with the best value; None where no job has one."""
    return next(iter(ranked(jobs, objective)), None)


def write_csv(jobs: Sequence[SweepJob], objective: Objective, path: Path) -> None:
    """One line for each job: its varied values, its results, and why it failed where it did."""
    varied = list(dict.fromkeys(key for job in jobs for key in job.varied))
    names = list(dict.fromkeys((objective.path, *NUMBERS)))
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, ["job", *varied, "status", *names, "run", "reason"])
        writer.writeheader()
        for job in jobs:
            status = {"job": job.number, "status": "failed" if job.reason else "finished", "run": job.name}
            numbers = {name: job.summary.get(name) for name in NUMBERS} | {objective.path: job.value}
            writer.writerow({**numbers, **job.varied, **status, "reason": " ".join(job.reason.split())})
