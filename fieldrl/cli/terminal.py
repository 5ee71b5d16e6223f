"""What a run says on the terminal: a line at its beginning, a bar, a table at its end."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from fieldrl.cli.progress_bar import ProgressBar
from fieldrl.runs import meaning
from fieldrl.runs.display import Display
from fieldrl.runs.folder import Run, tracked

_WIDTH = 80


class Bar(Display):
    """Shows progress only, where there is a terminal."""

    def progress(self, rows: NDArray[np.float64], episodes: int) -> AbstractContextManager[object]:
        """One bar for all replicates."""
        shown = console()
        return ProgressBar(rows, episodes, shown) if shown.is_terminal else nullcontext()


class Terminal(Bar):
    """Shows everything."""

    reused = "finished before"

    def note(self, text: str) -> None:
        """One line on standard error."""
        note(text)

    def beginning(self, run: Run, config: Mapping[str, Any], workers: int, continued: int) -> None:
        """One line: what is computed; another where it was interrupted before and goes on."""
        replicates, workers = config["replicates"], min(workers, config["replicates"])
        many = f"{replicates} x " if replicates > 1 else ""
        where = f" on {workers} workers" if workers > 1 else ""
        size = f"{many}{config['episodes']} episodes of {config['steps']} samples{where}"
        console().print(f"[bold]{run.name}[/]  {size}")
        if continued:
            total = replicates * (config["episodes"] + config["evaluation_episodes"])
            console().print(f"continued from its last checkpoint: {continued} of {total} episodes are done")

    def compiling(self) -> None:
        """One line: why nothing moves."""
        console().print("compiling the inner loops, once on this machine: half a minute ...")

    def waiting(self, name: str, holder: str) -> None:
        """One line: another process computes the same."""
        waiting(name, holder)

    def result(
        self,
        summary: Mapping[str, Any],
        run: Run,
        problem: str,
        reused: bool = False,
        continued: bool = False,
    ) -> None:
        """The table of a result, and where its files are."""
        if reused:
            console().print(f"[bold]{run.name}[/]  {self.reused}; force=true computes it again")
        self.outcome(summary)
        how = ", continued after an interruption" if continued else ""
        lines = {"time": f"{summary['seconds']:.1f} s{how}", "files": near(run.folder)}
        if tracked(run.folder):
            lines["MLflow"] = ui_command(run.output_dir)
        closing(lines, problem)

    def outcome(self, summary: Mapping[str, Any]) -> None:
        """What a result means, then its numbers."""
        outcome(summary)


def outcome(summary: Mapping[str, Any]) -> None:
    """What a result means, then its numbers."""
    console().print(escape(" ".join(meaning.sentences(summary))))
    console().print()
    console().print(table(summary))


def console() -> Console:
    """The terminal, or a plain file of 80 columns."""
    shown = Console(highlight=False)
    return shown if shown.is_terminal else Console(highlight=False, width=_WIDTH)


def note(text: str) -> None:
    """One line on standard error, such as a warning of a model."""
    Console(stderr=True, highlight=False, soft_wrap=True).print(f"[yellow]{escape(text)}[/]")


def waiting(name: str, holder: str) -> None:
    """One line: another process, as far as it is known, computes the same."""
    who = f"another process{f' ({holder})' if holder else ''}"
    console().print(f"{name} is being computed by {who}; waiting for its result ...", soft_wrap=True)


def closing(lines: Mapping[str, str], problem: str) -> None:
    """Where everything is, and a problem of the tracking."""
    for name, text in lines.items():
        console().print(f"[dim]{name:<7}[/] {text}", soft_wrap=True)
    if problem:
        console().print(f"[yellow]{escape(problem)}[/]", soft_wrap=True)


def columns(titles: Sequence[str], left: int = 1) -> Table:
    """A table without a frame whose first columns, ``left`` of them, are text."""
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False, header_style="bold")
    for i, title in enumerate(titles):
        shown.add_column(title, justify="left" if i < left else "right")
    return shown


def table(summary: Mapping[str, Any]) -> Table:
    """The result as a table: replicate 0, and the spread over the replicates where there are several.

    All samples' estimate stands first; the best episode after it, named for what it is.
    """
    rows = summary["replicates_table"]
    spread = [f"median of {len(rows)}\n\\[quartiles]"] if len(rows) > 1 else []
    shown = columns(["", "true or\nexpected", "first\nreplicate" if spread else "", *spread])
    best = f"best episode (number {summary['best_episode'] + 1})"
    sections = {
        f"all {summary['episodes'] * summary['steps']} samples": _parameters(summary, "pooled"),
        best: [*_parameters(summary), *_errors(summary)],
        "policy": _policy(summary),
    }
    for title, section in sections.items():
        lines = list(section)
        if lines:
            shown.add_row(f"[dim]{title}[/]")
        for label, true, values, *interval in lines:
            cells = (label, number(true), number(values[0], *interval), _spread(values))
            shown.add_row(*cells[: len(shown.columns)])
        shown.add_section()
    return shown


Row = tuple[Any, ...]
"""Label, true or expected value, value of each replicate; the first's interval where it has one."""


def _parameters(summary: Mapping[str, Any], part: str = "") -> Iterator[Row]:
    """The unknowns by the best episode, or by all samples (``pooled``)."""
    for name, about in summary["parameters"].items():
        rows = [row[part] if part else row for row in summary["replicates_table"]]
        first = rows[0]["parameters"][name]
        if first["estimate"] is not None:
            each = [row["parameters"][name]["estimate"] for row in rows]
            yield f"{name} \\[{about['unit']}]", about["true"], each, first.get("interval")


def _errors(summary: Mapping[str, Any]) -> Iterator[Row]:
    for name, label in meaning.error_labels(summary).items():
        yield label, None, [row[name] for row in summary["replicates_table"]]


def _policy(summary: Mapping[str, Any]) -> Iterator[Row]:
    """What is to be expected of e_total is 2 sigma^2: e_f and e_cv are sigma^2 each where theta is known."""
    expected = 2 * summary["noise"] ** 2
    yield "e_total, last quarter, mean", expected, summary["late_e_total"]
    if summary["greedy"]:
        yield "e_total, greedy policy", expected, [row["e_total"] for row in summary["greedy"]]
        yield "return, greedy policy", None, [row["return"] for row in summary["greedy"]]


def _spread(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    if len(known) < 2:
        return ""
    low, _, high = quantiles(known, n=4, method="inclusive")
    return f"{number(median(known))} \\[{number(low)}, {number(high)}]"


def number(value: float | None, interval: Sequence[float | None] | None = None) -> str:
    """Four significant digits, or as many as the interval leaves; empty where nothing is known."""
    if value is None:
        return ""
    ends = [end for end in interval or () if end is not None]
    return escape(meaning.rounded(value, ends)) if len(ends) == 2 else f"{value:#.4g}"


def near(path: Path) -> str:
    """``path`` relative to the current folder where that is shorter."""
    relative = os.path.relpath(path)
    return relative if len(relative) < len(str(path)) else str(path)


def ui_command(output_dir: Path) -> str:
    """The command that opens the UI on these runs."""
    if output_dir == Path.cwd() / "outputs" and Path("Makefile").exists() and Path("conf").is_dir():
        return "make ui"
    return f"python -m fieldrl.tracking.ui {near(output_dir)}"
