"""What a sweep says on the terminal: a line at its beginning, one for each job, tables at its end."""

from __future__ import annotations

import time
from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from fieldrl.cli import terminal
from fieldrl.cli.terminal import Bar, columns, console, near, number
from fieldrl.runs.title import short
from fieldrl.sweeps.objective import Objective
from fieldrl.sweeps.results import ranked
from fieldrl.sweeps.sweep import Sweep
from fieldrl.sweeps.sweep_job import SweepJob

_SHOWN = 20
"""Most rows of the table of results; of longer ones the best are shown."""


class SweepTerminal:
    """Shows everything; see ``sweeps.execution.SweepDisplay``."""

    def __init__(self) -> None:
        self._begun, self._computed = time.monotonic(), 0

    note = staticmethod(terminal.note)
    waiting = staticmethod(terminal.waiting)
    bar = Bar

    def beginning(self, sweep: Sweep, jobs: int, finished: int, workers: int) -> None:
        """One line: how much there is to do."""
        count = f"{jobs} job{'' if jobs == 1 else 's'}"
        before = f", {finished} finished before" if finished else ""
        where = f" on {workers} workers" if workers > 1 and finished < jobs else ""
        console().print(f"[bold]{sweep.name}[/]  {count}{before}{where}", soft_wrap=True)
        self._begun = time.monotonic()

    def job(self, job: SweepJob, done: int, jobs: int, objective: Objective, best: SweepJob | None) -> None:
        """One line about a job that ended; with the ``best`` so far, and how long the others may take."""
        names = short(list(job.varied))
        label = " ".join(f"{names[key]}={value}" for key, value in job.varied.items()) or job.label
        text = f"[dim]{done:>{len(str(jobs))}}/{jobs}[/]  {escape(label)}"
        if job.reason:
            text += f"  [red]failed[/]: {escape(job.reason.splitlines()[0])}"
        else:
            seconds = "" if job.reused else f"  [dim]{job.summary.get('seconds', 0.0):.1f} s[/]"
            text += f"  {objective.path} {number(job.value)}{seconds}"
        if best is not None:
            text += f"  [dim]best[/] {number(best.value)}"
        self._computed += not job.reused
        if self._computed and done < jobs:
            each = (time.monotonic() - self._begun) / self._computed
            text += f"  [dim]{duration(each * (jobs - done))} left[/]"
        console().print(text, soft_wrap=True)

    def results(self, jobs: Sequence[SweepJob], objective: Objective) -> None:
        """The table of results (of many jobs, the best), and one of failures where there are any."""
        order = ranked(jobs, objective)
        shown = order if len(jobs) > _SHOWN else [job for job in jobs if not job.reason]
        if shown:
            console().print()
            console().print(_results(shown[:_SHOWN], objective, order[0] if order else None))
            if len(jobs) > _SHOWN:
                count = f"the best {min(_SHOWN, len(shown))} of {len(order)}"
                console().print(f"[dim]{count}; results.csv has them all[/]")
        failed = [job for job in jobs if job.reason]
        if failed:
            table = columns([], 2)
            for title in ("failed job", "why"):
                table.add_column(title, overflow="fold")
            for job in failed:
                table.add_row(escape(job.label), escape(job.reason))
            console().print()
            console().print(table)

    def ending(self, sweep: Sweep, best: SweepJob | None, tracked: bool, problem: str) -> None:
        """Where everything is."""
        lines = {} if best is None or best.folder is None else {"best": near(best.folder)}
        lines["sweep"] = near(sweep.folder)
        if tracked:
            lines["MLflow"] = terminal.ui_command(sweep.output_dir)
        terminal.closing(lines, problem)


def duration(seconds: float) -> str:
    """A time as people say it: ``40 s``, ``3 min``, ``2.5 h``."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _results(jobs: Sequence[SweepJob], objective: Objective, best: SweepJob | None) -> Table:
    keys = list(dict.fromkeys(key for job in jobs for key in job.varied))
    others = [name for name in ("e_total", "theta_error") if name != objective.path]
    shown = columns([*short(keys).values(), objective.path, *others, "time"], len(keys))
    for job in jobs:
        numbers = [job.value, *(job.summary.get(name) for name in others)]
        cells = [*(escape(job.varied.get(key, "")) for key in keys), *(number(value) for value in numbers)]
        style = "bold" if job is best else None
        shown.add_row(*cells, f"{job.summary.get('seconds', 0.0):.1f} s", style=style)
    return shown
