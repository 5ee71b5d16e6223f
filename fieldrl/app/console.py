"""What a run says on the terminal: a line at its beginning, a table at its end."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from statistics import median, quantiles
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fieldrl.app.runs import Run

_ERRORS = {
    "e_f": "fit error e_f",
    "e_cv": "cross-validation error e_cv",
    "e_total": "e_total = e_f + e_cv",
    "theta_error": "|estimate - true|",
    "field_rmse": "field error, rms",
}
_WIDTH = 80


_hush: ContextVar[str] = ContextVar("hush", default="")
"""What is not shown: "" nothing, "lines" all but the progress bar, "all"."""


@contextmanager
def hushed(bar: bool) -> Iterator[None]:
    """Say nothing of a run while the body runs, but for its progress ``bar`` where that is wanted."""
    token = _hush.set("lines" if bar else "all")
    try:
        yield
    finally:
        _hush.reset(token)


def console(bar: bool = False) -> Console:
    """The terminal, or a plain file of 80 columns; ``bar``: for a progress bar."""
    if _hush.get() == "all" or (_hush.get() == "lines" and not bar):
        return Console(quiet=True, file=io.StringIO())
    screen = Console(highlight=False)
    return screen if screen.is_terminal else Console(highlight=False, width=_WIDTH)


def beginning(name: str, config: Mapping[str, Any], workers: int) -> None:
    """One line: what is computed."""
    replicates = f"{config['replicates']} x " if config["replicates"] > 1 else ""
    where = f" on {workers} workers" if workers > 1 else ""
    size = f"{replicates}{config['episodes']} episodes of {config['steps']} samples{where}"
    console().print(f"[bold]{name}[/]  {size}")


def continued(done: int, total: int) -> None:
    """One line: the run was interrupted before and goes on."""
    console().print(f"continued from its last checkpoint: {done} of {total} episodes are done")


def note(text: str) -> None:
    """One line beside the results, such as a warning of a model."""
    if _hush.get():
        return
    Console(stderr=True, highlight=False, soft_wrap=True).print(f"[yellow]{escape(text)}[/]")


def waiting(name: str, holder: str) -> None:
    """One line: another process computes the same run."""
    who = another_process(holder)
    console().print(f"{name} is being computed by {who}; waiting for its result ...", soft_wrap=True)


def another_process(holder: str) -> str:
    """Who holds a run or a sweep, as far as it is known."""
    return f"another process{f' ({holder})' if holder else ''}"


@contextmanager
def compiling() -> Iterator[None]:
    """On a terminal, say why nothing moves while the compiled loops are made or loaded."""
    screen = console(bar=True)
    if not screen.is_terminal:
        yield
        return
    with screen.status("loading compiled loops (the first time on a machine: half a minute)"):
        yield


def result(
    summary: Mapping[str, Any], run: Run, problem: str = "", reused: bool = False, continued: bool = False
) -> None:
    """The table of a result, and where its files are."""
    screen = console()
    if reused:
        screen.print(f"[bold]{run.name}[/]  finished before; force=true computes it again")
    screen.print(table(summary))
    how = ", continued after an interruption" if continued else ""
    lines = {"time": f"{summary['seconds']:.1f} s{how}", "files": near(run.folder)}
    if (run.folder / "tracking.json").exists():
        lines["MLflow"] = ui_command(run.output_dir)
    for name, text in lines.items():
        screen.print(f"[dim]{name:<7}[/] {text}", soft_wrap=True)
    if problem:
        screen.print(f"[yellow]{problem}[/]", soft_wrap=True)


def table(summary: Mapping[str, Any]) -> Table:
    """The result as a table: replicate 0, and the spread over the replicates where there are several."""
    rows = summary["replicates_table"]
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold")
    shown.add_column("")
    best, spread = (
        f"best episode\n(number {summary['best_episode']})",
        f"median of {len(rows)}\n\\[quartiles]",
    )
    for title in ("true or\nexpected", best, spread)[: 3 if len(rows) > 1 else 2]:
        shown.add_column(title, justify="right")
    for section in (_parameters(summary), _errors(summary), _policy(summary), _pooled(summary)):
        for label, true, values in section:
            cells = (label, _number(true), _number(values[0]), _spread(values))
            shown.add_row(*cells[: len(shown.columns)])
        shown.add_section()
    return shown


Row = tuple[str, "float | None", "Sequence[float | None]"]
"""Label, true or expected value, value of each replicate."""


def _parameters(summary: Mapping[str, Any]) -> Iterator[Row]:
    for name, value in summary["parameters"].items():
        each = [row["parameters"][name]["estimate"] for row in summary["replicates_table"]]
        yield f"{name} \\[{value['unit']}]", value["true"], each


def _errors(summary: Mapping[str, Any]) -> Iterator[Row]:
    for name, label in _ERRORS.items():
        yield label, None, [row[name] for row in summary["replicates_table"]]


def _policy(summary: Mapping[str, Any]) -> Iterator[Row]:
    """What is to be expected of e_total is 2 sigma^2: e_f and e_cv are sigma^2 each where theta is known."""
    expected = 2 * summary["noise"] ** 2
    yield "e_total, last quarter, mean", expected, summary["late_e_total"]
    if summary["greedy"]:
        yield "e_total, greedy policy", expected, [row["e_total"] for row in summary["greedy"]]
        yield "return, greedy policy", None, [row["return"] for row in summary["greedy"]]


def _pooled(summary: Mapping[str, Any]) -> Iterator[Row]:
    rows = summary["replicates_table"]
    for name in summary["pooled"]["parameters"]:
        each = [row["pooled"]["parameters"][name]["estimate"] for row in rows]
        if each[0] is not None:
            true = summary["parameters"][name]["true"]
            yield f"{name}, from all samples", true, each


def _spread(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    if len(known) < 2:
        return ""
    low, _, high = quantiles(known, n=4, method="inclusive")
    return f"{_number(median(known))} \\[{_number(low)}, {_number(high)}]"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:#.4g}"


def near(path: Path) -> str:
    """``path`` relative to the current folder where that is shorter."""
    relative = os.path.relpath(path)
    return relative if len(relative) < len(str(path)) else str(path)


def ui_command(output_dir: Path) -> str:
    """The command that opens the UI on these runs."""
    if output_dir == Path.cwd() / "outputs" and Path("Makefile").exists() and Path("conf").is_dir():
        return "make ui"
    return f"python -m fieldrl.app.ui {near(output_dir)}"
