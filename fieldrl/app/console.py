"""What a run says on the terminal: a line at its beginning, a table at its end."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from statistics import median, quantiles
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from fieldrl.app.runs import Run

_LABELS = {
    "e_f": "fit error e_f",
    "e_cv": "cross-validation error e_cv",
    "e_total": "e_total = e_f + e_cv",
    "theta_error": "|estimate - true|",
    "field_rmse": "field error (rms)",
}


def console() -> Console:
    """The terminal, or a plain file of 80 columns."""
    screen = Console(highlight=False, soft_wrap=False)
    return screen if screen.is_terminal else Console(highlight=False, width=80)


def beginning(name: str, config: Mapping[str, Any], workers: int) -> None:
    """One line: what is computed."""
    replicates = f"{config['replicates']} x " if config["replicates"] > 1 else ""
    where = f" on {workers} workers" if workers > 1 else ""
    size = f"{replicates}{config['episodes']} episodes of {config['steps']} samples{where}"
    console().print(f"[bold]{name}[/]  {size}")


def waiting(name: str) -> None:
    """One line: another process computes the same run."""
    console().print(f"{name} is being computed by another process; waiting for its result ...")


def result(summary: Mapping[str, Any], run: Run, problem: str = "", reused: bool = False) -> None:
    """The table of a result, and where its files are."""
    screen = console()
    if reused:
        screen.print(f"[bold]{run.name}[/]  finished before; force=true computes it again")
    screen.print(_table(summary))
    screen.print(f"files  {_near(run.folder)}", soft_wrap=True)
    if problem:
        screen.print(f"[yellow]{problem}[/]", soft_wrap=True)
    elif summary_is_tracked(run):
        screen.print(f"MLflow {_ui(run.output_dir)}", soft_wrap=True)


def summary_is_tracked(run: Run) -> bool:
    """Whether MLflow has the run."""
    return (run.folder / "tracking.json").exists()


def _table(summary: Mapping[str, Any]) -> Table:
    rows = summary.get("replicates_table") or []
    several = len(rows) > 1
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column(_title(summary))
    table.add_column("true", justify="right")
    table.add_column("best", justify="right")
    if several:
        table.add_column(f"median of {len(rows)} [quartiles]", justify="right")
    for cells in (*_parameters(summary), *_errors(summary)):
        table.add_row(*(cells if several else cells[:3]))
    return table


def _title(summary: Mapping[str, Any]) -> str:
    return f"episode {summary['best_episode']} of {summary['episodes']}"


def _parameters(summary: Mapping[str, Any]) -> Iterable[tuple[str, str, str, str]]:
    rows = summary.get("replicates_table") or []
    for name, value in summary["parameters"].items():
        each = [row["parameters"][name]["estimate"] for row in rows]
        unit = f" \\[{value['unit']}]" if value.get("unit") else ""
        yield f"{name}{unit}", _number(value["true"]), _number(value["estimate"]), _spread(each)


def _errors(summary: Mapping[str, Any]) -> Iterable[tuple[str, str, str, str]]:
    rows = summary.get("replicates_table") or []
    for name, label in _LABELS.items():
        each = [row.get(name) for row in rows]
        yield label, "", _number(summary.get(name)), _spread(each)


def _spread(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    if len(known) < 2:
        return ""
    low, _, high = quantiles(known, n=4, method="inclusive")
    return f"{_number(median(known))} \\[{_number(low)}, {_number(high)}]"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


def _near(path: Path) -> str:
    """``path`` relative to the current folder where that is shorter."""
    relative = os.path.relpath(path)
    return relative if len(relative) < len(str(path)) else str(path)


def _ui(output_dir: Path) -> str:
    """The command that opens the UI on these runs."""
    if output_dir == Path.cwd() / "outputs" and Path("Makefile").exists() and Path("conf").is_dir():
        return "make ui"
    return f"python -m fieldrl.app.ui {_near(output_dir)}"
