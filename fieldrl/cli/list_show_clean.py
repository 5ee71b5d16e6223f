"""``fieldrl list``, ``show`` and ``clean``: what is on disk."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from rich.markup import escape

from fieldrl.cli import terminal
from fieldrl.core.checks import FieldrlError
from fieldrl.runs import inventory, meaning
from fieldrl.runs.inventory import Found

_DEFAULT = "outputs"


def list_runs(arguments: Sequence[str]) -> None:
    """``fieldrl list [output_dir=...]``: every run, the newest first."""
    output_dir, names, _ = words(arguments, ())
    if names:
        raise FieldrlError(f"{names[0]}: list takes output_dir= alone; fieldrl show RUN shows a run")
    found = inventory.runs(output_dir)
    if not found:
        terminal.console().print(f"no runs in {terminal.near(output_dir)}")
        return
    shown = terminal.columns(["run", "key", "e_total", "estimate, all samples"], 2)
    shown.columns[3].justify = "left"
    for one in found:
        shown.add_row(escape(one.title), one.run.key, *_result(one))
    terminal.console().print(shown)


def show(arguments: Sequence[str]) -> None:
    """``fieldrl show RUN... [output_dir=...]``: the result of finished runs, as when they ended."""
    output_dir, names, _ = words(arguments, ())
    if not names:
        raise FieldrlError("fieldrl show RUN: which one? its name, its key, or the beginning of that")
    for one in inventory.named(names, output_dir):
        _show(one)


def clean(arguments: Sequence[str]) -> None:
    """``fieldrl clean [RUN...] [output_dir=...] [--yes]``: remove unfinished or named runs; asks first."""
    output_dir, names, flags = words(arguments, ("--yes",))
    if names:
        found = inventory.named(names, output_dir)
    else:
        found = [one for one in inventory.runs(output_dir) if not one.summary]
    free = []
    for one in found:
        if inventory.held(one.run):
            terminal.console().print(f"{one.run.name} is being computed; it stays")
        else:
            free.append(one)
    if not free:
        terminal.console().print("nothing to remove" if names else "no unfinished runs to remove")
    elif "--yes" in flags or _agreed(free):
        removed = [one for one in free if inventory.remove(one.run)]
        terminal.console().print(f"{len(removed)} removed")


def words(arguments: Sequence[str], flags: Sequence[str]) -> tuple[Path, list[str], set[str]]:
    """Output folder, other words, and which of the flags are given."""
    output_dir, names, given = _DEFAULT, [], set()
    for word in arguments:
        key, equals, value = word.partition("=")
        if equals and key == "output_dir" and value:
            output_dir = value
        elif word in flags:
            given.add(word)
        elif equals or word.startswith("-"):
            allowed = ", ".join(["output_dir=FOLDER", *flags])
            raise FieldrlError(f"{word}: not understood here; the options are {allowed}")
        else:
            names.append(word)
    return Path(output_dir).expanduser().resolve(), names, given


def _result(one: Found) -> tuple[str, str]:
    if not one.summary:
        return "", "being computed" if inventory.held(one.run) else "unfinished"
    known = ", ".join(
        f"{it.name} {meaning.rounded(it.value, it.interval)}" for it in meaning.estimates(one.summary)
    )
    return terminal.number(one.summary.get("e_total")), escape(known)


def _show(one: Found) -> None:
    if not one.summary:
        raise FieldrlError(f"{one.run.name}: is not finished; {one.command} continues it")
    terminal.console().print(f"[bold]{escape(one.title)}[/]")
    terminal.outcome(one.summary)
    lines = {"files": terminal.near(one.run.folder), "repeat": escape(one.command)}
    terminal.closing(lines, "")


def _agreed(free: Sequence[Found]) -> bool:
    """Whether the person at the terminal wants them removed."""
    for one in free:
        terminal.console().print(f"{one.run.name}  {escape(one.title)}", soft_wrap=True)
    if not sys.stdin.isatty():
        raise FieldrlError("nobody is there to be asked; --yes removes them")
    what = "this run" if len(free) == 1 else f"these {len(free)} runs"
    return input(f"Remove {what}? [y/N] ").strip().lower() in ("y", "yes")
