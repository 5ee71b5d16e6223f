"""``fieldrl report``: a run's page made anew, or several runs, or a sweep's, side by side."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from fieldrl.cli import terminal
from fieldrl.cli.list_show_clean import words
from fieldrl.core.checks import FieldrlError
from fieldrl.runs import atomic, comparison, inventory, netcdf, run_page, title
from fieldrl.runs.identity import key
from fieldrl.runs.inventory import Found


def main(arguments: Sequence[str]) -> None:
    """``fieldrl report RUN... [output_dir=...]``: write a page, say where it is."""
    output_dir, names, _ = words(arguments, ())
    if not names:
        raise FieldrlError("fieldrl report RUN ...: which? names or keys of runs, or of a sweep")
    sweep = inventory.sweep(names[0], output_dir) if len(names) == 1 else None
    if sweep is not None:
        path = _of_sweep(sweep, output_dir)
    else:
        found = [_finished(one) for one in inventory.named(names, output_dir)]
        path = _of_run(found[0]) if len(found) == 1 else _of_several(found, output_dir)
    terminal.console().print(terminal.near(path), soft_wrap=True)


def _of_run(one: Found) -> Path:
    record = netcdf.read(one.run.folder / "record.nc", one.run.key)
    if record is None:
        raise FieldrlError(f"{one.run.name}: its record is damaged; {one.command} computes it again")
    changed = title.changes(one.overrides)
    page = run_page.page(record, one.summary, one.run.folder, one.title, one.command, changed)
    return atomic.write(one.run.folder / "report.html", page)


def _of_several(found: Sequence[Found], output_dir: Path) -> Path:
    names = [one.run.name for one in found]
    command = shlex.join(["fieldrl", "report", *names])
    page = comparison.page(found, f"{len(found)} runs side by side", command)
    return atomic.write(output_dir / "reports" / f"{key(sorted(names))}.html", page)


def _of_sweep(folder: Path, output_dir: Path) -> Path:
    names = inventory.jobs(folder)
    found = [one for one in inventory.named(names, output_dir) if one.summary] if names else []
    if not found:
        raise FieldrlError(f"{folder.name}: none of its jobs is finished")
    pictures = run_page.pictures(folder / "figures")
    page = comparison.page(found, folder.name, shlex.join(["fieldrl", "report", folder.name]), pictures)
    return atomic.write(folder / "report.html", page)


def _finished(one: Found) -> Found:
    if not one.summary:
        raise FieldrlError(f"{one.run.name}: is not finished; {one.command} continues it")
    return one
