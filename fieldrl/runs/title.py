"""What people call a run: its experiment and what differs from it; and the command that repeats it."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence

import yaml

from fieldrl.runs.configuration import GROUPS
from fieldrl.runs.identity import WITHOUT_EFFECT
from fieldrl.runs.options import directory

_LONGEST = 72


def changes(overrides: Iterable[str]) -> dict[str, str]:
    """Value by key of the overrides that change a result, the choice of the experiment apart.

    Args:
        overrides: KEY=VALUE as typed.
    """
    pairs = (override.lstrip("+~").partition("=") for override in overrides)
    return {key: value for key, _, value in pairs if key != "experiment" and not _without_effect(key)}


def title(experiment: str, changed: Mapping[str, str]) -> str:
    """``double_gyre seed=3 lawnmower``: an option of a group stands for itself, a key for its last part.

    Args:
        experiment: its name; "" leaves it out.
        changed: value by key, see ``changes``.
    """
    names = short(list(changed))
    words = [value if key in GROUPS else f"{names[key]}={value}" for key, value in changed.items()]
    text = " ".join([experiment, *words] if experiment else words) or "defaults"
    return text if len(text) <= _LONGEST else text[: _LONGEST - 4].rstrip() + " ..."


def short(keys: Sequence[str]) -> dict[str, str]:
    """The last part of each key, the whole key where two end alike."""
    last = [key.rpartition(".")[2] for key in keys]
    return {key: name if last.count(name) == 1 else key for key, name in zip(keys, last, strict=True)}


def overrides_of(text: str) -> tuple[str, ...]:
    """The overrides that a run was asked for with, from the text of ``.hydra/overrides.yaml``."""
    try:
        found = yaml.safe_load(text)
    except yaml.YAMLError:  # a killed run's
        return ()
    return tuple(str(override) for override in found) if isinstance(found, list) else ()


def command(experiment: str, overrides: Iterable[str]) -> str:
    """The command line that gives the same run."""
    words = [f"{key}={value}" for key, value in changes(overrides).items()]
    return shlex.join(["fieldrl", f"experiment={experiment}", *words])


def about(experiment: str) -> tuple[str, list[str]]:
    """What an experiment asks and the commands that its option file opens with; nothing where it has none."""
    try:
        lines = (directory() / "experiment" / f"{experiment}.yaml").read_text().splitlines()
    except OSError:
        return "", []
    head = [line.lstrip("# ") for line in lines if line.startswith("# ") and "@package" not in line]
    commands = [line for line in head if line.startswith("fieldrl")]
    return " ".join(line for line in head if line not in commands), commands


def _without_effect(key: str) -> bool:
    return key.startswith("hydra") or any(
        key == path or key.startswith(f"{path}.") for path in WITHOUT_EFFECT
    )
