"""``fieldrl suggest``: where to sample next, from samples in a file or from an estimate that was made."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from fieldrl.cli import help as help_text
from fieldrl.cli import terminal
from fieldrl.cli.estimate import Shown, estimate_job
from fieldrl.cli.list_show_clean import words
from fieldrl.core.checks import FieldrlError
from fieldrl.mission.suggestion import Suggestion
from fieldrl.runs import estimate_job as made
from fieldrl.runs import inventory, suggest_job
from fieldrl.runs.folder import Run

_KEYS = {
    "count": "how many samples (5)",
    "times": "when they may be taken, [12,14] or 12; else when the last sample was [time]",
    "places": "a CSV of allowed positions, columns x,y; else the model's domain less its obstacles",
    "reach": "at most so far from the last sample's place [length]",
    "apart": "samples at the same time keep this distance [length]",
}


def main(arguments: Sequence[str]) -> None:
    """Make or find the estimate, show what follows from it, write it to the estimate's folder.

    Args:
        arguments: a file of samples with what ``fieldrl estimate`` takes, or an estimate's folder, name or
            key; and settings of the suggestion.

    Raises:
        FieldrlError: file, configuration or command line are refused.
    """
    if {"-h", "--help"} & set(arguments):
        usage, what = help_text.VERBS["suggest"]
        print(f"usage: fieldrl {usage}\n       fieldrl suggest ESTIMATE [KEY=VALUE ...]\n\n{what}.\n")
        print("\n".join(f"  {key:<7} {text}" for key, text in _KEYS.items()))
        return
    own = {word.partition("=")[0] for word in arguments} & set(_KEYS)
    wanted = dict(_setting(word) for word in arguments if word.partition("=")[0] in own)
    others = [word for word in arguments if word.partition("=")[0] not in own]
    run = _estimate(others)
    _show(suggest_job.perform(run, wanted), run)


def _setting(word: str) -> tuple[str, Any]:
    key, _, text = word.partition("=")
    try:
        return key, text if key == "places" else yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise FieldrlError(f"{word}: cannot be read; {key} is {_KEYS[key]}") from error


def _estimate(arguments: Sequence[str]) -> Run:
    """An estimate that is named, or that samples and a model give."""
    named = [word for word in arguments if Path(word).name.startswith("estimate-") and "=" not in word]
    if len(named) != 1 or Path(named[0]).is_file():
        job = estimate_job(arguments)
        made.perform(job, Shown())
        return job.job.run
    rest = [word for word in arguments if word not in named]
    path = Path(named[0]).expanduser().resolve()
    given = [f"output_dir={path.parents[1]}"] if path.is_dir() else []
    output_dir, _, _ = words([*given, *rest], ())
    return inventory.named([path.name], output_dir)[0].run


def _show(found: Suggestion, run: Run) -> None:
    """The samples to take, and what is to be expected of them."""
    names, units = found.parameters.names, found.parameters.units
    std = [f"std of {name}\n\\[{unit}]" for name, unit in zip(names, units, strict=True)]
    shown = terminal.columns(["", "time", "x", "y", "expected\nvalue", "gain\n\\[nat]", *std])
    shown.add_row("now", "", "", "", "", "", *map(_number, found.std[0]))
    rows = zip(found.times, *found.positions.T, found.predictions, found.gains, strict=True)
    for k, row in enumerate(rows, start=1):
        shown.add_row(str(k), *map(_number, row), *map(_number, found.std[k]))
    terminal.console().print()
    terminal.console().print(shown)
    where = {"table": run.folder / suggest_job.TABLE, "picture": run.folder / "figures" / suggest_job.PICTURE}
    terminal.closing({name: terminal.near(path) for name, path in where.items()}, "")


def _number(value: float) -> str:
    return f"{value:.4g}"
