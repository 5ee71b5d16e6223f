"""What a sweep says on the terminal: a line at its beginning, one for each job, tables at its end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich import box
from rich.markup import escape
from rich.table import Table

from fieldrl.app import console
from fieldrl.app.sweeps.objective import Objective
from fieldrl.app.sweeps.results import Row, ranked
from fieldrl.app.sweeps.sweep import Sweep

_SHOWN = 20
"""Most rows of the table of results; of longer ones the best are shown."""


def beginning(sweep: Sweep, jobs: int, finished: int, workers: int) -> None:
    """One line: how much there is to do."""
    before = f", {finished} finished before" if finished else ""
    where = f" on {workers} workers" if workers > 1 and finished < jobs else ""
    console.console().print(f"[bold]{sweep.name}[/]  {_count(jobs, 'job')}{before}{where}", soft_wrap=True)


def waiting(sweep: Sweep, holder: str) -> None:
    """One line: another process conducts the same sweep."""
    who = console.another_process(holder)
    console.console().print(f"{sweep.name} is being run by {who}; waiting for it ...", soft_wrap=True)


def job(row: Row, done: int, jobs: int, objective: Objective, best: Row | None = None) -> None:
    """One line about a job that ended; with the ``best`` so far where it is not the first."""
    names = _short(list(row.varied))
    label = " ".join(f"{names[key]}={value}" for key, value in row.varied.items()) or row.label
    place = f"[dim]{done:>{len(str(jobs))}}/{jobs}[/]  {escape(label)}"
    if row.reason:
        text = f"{place}  [red]failed[/]: {escape(row.reason.splitlines()[0])}"
    else:
        seconds = "" if row.reused else f"  [dim]{row.summary.get('seconds', 0.0):.1f} s[/]"
        text = f"{place}  {objective.path} {_number(row.value)}{seconds}"
    if best is not None:
        text += f"  [dim]best[/] {_number(best.value)}"
    console.console().print(text, soft_wrap=True)


def results(rows: Sequence[Row], objective: Objective) -> None:
    """The table of results (of many jobs, the best), and one of failures where there are any."""
    screen = console.console()
    order = ranked(rows, objective)
    shown = order if len(rows) > _SHOWN else [row for row in rows if not row.reason]
    if shown:
        screen.print()
        screen.print(_results(shown[:_SHOWN], objective, order[0] if order else None))
        if len(rows) > _SHOWN:
            screen.print(
                f"[dim]the best {min(_SHOWN, len(shown))} of {len(order)}; results.csv has them all[/]"
            )
    failed = [row for row in rows if row.reason]
    if failed:
        screen.print()
        screen.print(_failures(failed))


def ending(sweep: Sweep, found: Row | None, tracked: bool, problem: str) -> None:
    """Where everything is."""
    screen = console.console()
    lines: dict[str, str] = {}
    if found is not None and found.folder is not None:
        lines["best"] = console.near(found.folder)
    lines["sweep"] = console.near(sweep.folder)
    if tracked:
        lines["MLflow"] = console.ui_command(sweep.output_dir)
    for name, text in lines.items():
        screen.print(f"[dim]{name:<7}[/] {text}", soft_wrap=True)
    if problem:
        screen.print(f"[yellow]{escape(problem)}[/]", soft_wrap=True)


def _results(rows: Sequence[Row], objective: Objective, best: Row | None) -> Table:
    keys = list(dict.fromkeys(key for row in rows for key in row.varied))
    others = [name for name in ("e_total", "theta_error") if name != objective.path]
    shown = _table([*_short(keys).values(), objective.path, *others, "time"], len(keys))
    for row in rows:
        numbers = [row.value, *(row.summary.get(name) for name in others)]
        cells = [*(escape(row.varied.get(key, "")) for key in keys), *(_number(value) for value in numbers)]
        style = "bold" if row is best else None
        shown.add_row(*cells, f"{row.summary.get('seconds', 0.0):.1f} s", style=style)
    return shown


def _failures(rows: Sequence[Row]) -> Table:
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold")
    for title in ("failed job", "why"):
        shown.add_column(title, overflow="fold")
    for row in rows:
        shown.add_row(escape(row.label), escape(row.reason))
    return shown


def _table(titles: Sequence[str], left: int) -> Table:
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold")
    for i, title in enumerate(titles):
        shown.add_column(title, justify="left" if i < left else "right")
    return shown


def _short(keys: Sequence[str]) -> Mapping[str, str]:
    """The last part of each key, the whole key where two end alike."""
    last = [key.rpartition(".")[2] for key in keys]
    return {key: name if last.count(name) == 1 else key for key, name in zip(keys, last, strict=True)}


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:#.4g}"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
