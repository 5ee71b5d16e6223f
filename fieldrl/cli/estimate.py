"""``fieldrl estimate FILE [KEY=VALUE ...]``: the unknowns of a model from samples in a file."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from fieldrl.cli import help as help_text
from fieldrl.cli import terminal
from fieldrl.cli.bad_overrides import refused
from fieldrl.cli.compose import plain, unresolved
from fieldrl.core.checks import FieldrlError
from fieldrl.runs.configuration import Composed
from fieldrl.runs.estimate_job import EstimateJob, perform
from fieldrl.runs.folder import Run, text
from fieldrl.runs.title import overrides_of

_READER, _LOSS = "+measurements=sample_file", "loss="
_MODEL = re.compile(r"[+~]*(experiment|pde|unknown|estimator)\b")


def main(arguments: Sequence[str]) -> None:
    """Make the estimate, or find it made, and show it.

    Args:
        arguments: the file, and overrides.

    Raises:
        FieldrlError: file, configuration or command line are refused.
    """
    if {"-h", "--help"} & set(arguments):
        usage, what = help_text.VERBS["estimate"]
        print(f"usage: fieldrl {usage}\n\n{what}. FILE is CSV, Parquet, NetCDF or a run's record.\n")
        print(
            f"keys of measurements, in {help_text.directory()}/measurements/sample_file.yaml; docs/samples.md"
        )
        return
    perform(estimate_job(arguments), Shown())


def estimate_job(arguments: Sequence[str]) -> EstimateJob:
    """The estimate that a command line asks for; raises as ``main``."""
    arguments, folders = _config_folders(arguments)
    files = [word for word in arguments if "=" not in word or Path(word).exists()]
    overrides = [word for word in arguments if word not in files]
    if len(files) != 1 or files[0].startswith("-"):
        usage, _ = help_text.VERBS["estimate"]
        given = f"given: {' '.join(files)}" if files else "none was given"
        raise FieldrlError(f"one file of samples is needed, {given}; fieldrl {usage}")
    overrides = [*_experiment(files[0], overrides), *overrides]
    loss = [word for word in overrides if word.startswith(_LOSS)] or [f"{_LOSS}squared"]
    given = [_READER, f"+{loss[-1]}", *(word for word in overrides if not word.startswith(_LOSS))]
    try:
        config = plain(unresolved([*_searched(folders), *given]))
    except (HydraException, OmegaConfBaseException, ValueError, TypeError, YAMLError) as error:
        if isinstance(error, FieldrlError):
            raise
        raise refused(error, given) from error
    composed = Composed(dict(config), "estimate", tuple(overrides))
    measurements, loss = config.pop("measurements"), config.pop("loss")
    options = [f"--config-dir={folder}" for folder in folders]
    command = shlex.join(["fieldrl", "estimate", *options, files[0], *overrides])
    return EstimateJob.of(files[0], config, measurements, loss, composed.files(), command)


def _config_folders(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """The command line without --config-dir, and its folders."""
    rest, folders, given = [], [], iter(arguments)
    for word in given:
        option, equals, folder = word.partition("=")
        if option not in ("--config-dir", "-cd"):
            rest.append(word)
            continue
        path = Path(folder if equals else next(given, "")).expanduser()
        if not path.is_dir() or path == Path():
            raise FieldrlError(f"--config-dir={path}: there is no such folder")
        folders.append(str(path.resolve()))
    return rest, folders


def _searched(folders: Sequence[str]) -> list[str]:
    """What tells Hydra of folders of configuration."""
    return [f"hydra.searchpath=[{','.join(map(repr, folders))}]"] if folders else []


def _experiment(file: str, overrides: Sequence[str]) -> list[str]:
    """What chose the model and the estimator of the run whose record is the file, where none is named."""
    if any(word.startswith(("experiment=", "pde=")) for word in overrides):
        return []
    path = Path(file) / "record.nc" if Path(file).is_dir() else Path(file)
    name = path.parent.name.rpartition("-")[0] if path.name == "record.nc" else ""
    kept = [
        word
        for word in overrides_of(text(path.parent / ".hydra" / "overrides.yaml"))
        if name and _MODEL.match(word)
    ]
    if any(word.startswith("experiment=") for word in kept):
        return kept
    from fieldrl.runs.options import options

    if name not in options("experiment"):
        known = ", ".join(options("experiment"))
        raise FieldrlError(f"which model is meant? experiment=NAME says it; choose one of {known}")
    return [f"experiment={name}", *kept]


class Shown(terminal.Terminal):
    """An estimate on the terminal."""

    reused = "made before"

    def beginning(self, run: Run, config: Mapping[str, Any], workers: int, continued: int) -> None:
        """One line: what is computed."""
        terminal.console().print(
            f"[bold]{run.name}[/]  {config['steps']} samples, {config['steps'] + 1} fits"
        )

    def outcome(self, summary: Mapping[str, Any]) -> None:
        """What became of the samples, the estimate, its errors and the verdict."""
        for line in samples_lines(summary["samples"]):
            terminal.console().print(line, soft_wrap=True)
        terminal.console().print(_table(summary))
        terminal.console().print(summary["verdict"])


def samples_lines(samples: Mapping[str, Any]) -> list[str]:
    """How many rows were used, why others were not, and what was understood of the file."""
    lines = [f"{samples['used']} of {samples['rows']} rows are used"]
    lines += [f"  {count} left out: {reason}" for reason, count in samples["dropped_because"].items()]
    return [*lines, *(f"  {note}" for note in samples["notes"])]


def _table(summary: Mapping[str, Any]) -> Any:
    """Estimates with their intervals, then the errors."""
    shown = terminal.columns(["", "estimate", "95 % interval"])
    for name, one in summary["parameters"].items():
        low, high = (terminal.number(end) for end in one["interval"])
        shown.add_row(f"{name} \\[{one['unit']}]", terminal.number(one["estimate"]), f"{low} to {high}")
    shown.add_section()
    stated = "stated" if summary["noise_stated"] else "estimated"
    for name, label in (
        ("e_f", "fit error e_f"),
        ("e_cv", "cross-validation error e_cv"),
        ("e_total", "e_total = e_f + e_cv"),
        ("noise", f"standard deviation of the noise, {stated}"),
    ):
        shown.add_row(label, terminal.number(summary[name]), "")
    return shown
