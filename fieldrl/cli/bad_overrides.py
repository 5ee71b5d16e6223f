"""What was wrong with a command line, in one to three lines, from the error that Hydra raised about it."""

from __future__ import annotations

from collections.abc import Sequence

from hydra.errors import MissingConfigException, OverrideParseException
from omegaconf import DictConfig, OmegaConf

from fieldrl.cli.compose import unresolved
from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.runs.configuration import GROUPS, suggestion
from fieldrl.runs.explain import first_line
from fieldrl.runs.options import options

_LISTS = "write KEY=VALUE, and quote what the shell would read: 'vehicle.start=[30,40]'"
_HINTS = {
    "Multiple values": "the group has an option already; leave out the +",
    "Could not append": "the key exists already; leave out the +",
    "Could not delete": "no such key, so nothing to delete; leave this out",
    "Ambiguous value": "several values make a sweep, which needs -m; a list is written KEY=[1,2]",
    "Sweep parameters": "several values make a sweep, which needs -m",
}
"""Ways out for what Hydra says at length, by how it begins."""


def refused(error: Exception, arguments: Sequence[str]) -> FieldrlError:
    """What was wrong with the command line, from the error that Hydra's composition raised.

    Args:
        error: the error.
        arguments: the command line.
    """
    overrides = [argument for argument in arguments if not argument.startswith("-")]
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        return unknown_option(error.missing_cfg_file, list(error.options or ()))
    if isinstance(error, OverrideParseException):
        return FieldrlError(f"{error.override}: cannot be read; {_LISTS}")
    key = getattr(error.__cause__, "full_key", None)
    if key:
        return _unknown_key(str(key), overrides)
    culprit = _culprit(overrides)
    remedy = next((hint for start, hint in _HINTS.items() if str(error).startswith(start)), "")
    return FieldrlError(f"{culprit}: {remedy or first_line(error)}")


def unknown_option(path: str, available: Sequence[str]) -> InvalidValue:
    """The error for an option file that is not there ("agent/foo")."""
    group, _, option = path.removeprefix("/").rpartition("/")
    if option.startswith("submitit"):
        return InvalidValue(group, option, "is not installed", remedy="pip install 'fieldrl[slurm]'")
    available = available or options(group)
    return InvalidValue(group, option, "no such option", remedy=f"choose one of {', '.join(available)}")


def _unknown_key(key: str, overrides: Sequence[str]) -> InvalidValue:
    """The error for a key that is not there, with the keys that are."""
    known: object = _composed([item for item in overrides if _is_choice(item)])
    if key.startswith("hydra"):
        return InvalidValue(
            key, _value(key, overrides), "unknown key", remedy="fieldrl --cfg hydra shows them"
        )
    path, parts = "", key.split(".")
    for part in parts:
        if not isinstance(known, DictConfig) or part not in known:
            break
        path, known = f"{path}{part}.", known[part]
    name = parts[min(path.count("."), len(parts) - 1)]
    keys = [str(item) for item in known if item != "_target_"] if isinstance(known, DictConfig) else []
    return InvalidValue(f"{path}{name}", _value(key, overrides), "unknown key", remedy=suggestion(name, keys))


def _composed(overrides: Sequence[str]) -> DictConfig:
    """The configuration with these overrides; empty where they cannot be composed."""
    try:
        return unresolved(overrides)
    except Exception:  # the error that is being explained comes first
        return OmegaConf.create()


def _culprit(overrides: Sequence[str]) -> str:
    """The first override that cannot be composed alone; all of them where none is found."""
    for override in overrides:
        if not _composed([override]):
            return override
    return " ".join(overrides)


def _key(override: str) -> str:
    return override.partition("=")[0].lstrip("+~")


def _is_choice(override: str) -> bool:
    """Whether an override chooses a known option of a group."""
    group = _key(override)
    return group in (*GROUPS, "experiment") and override.partition("=")[2] in options(group)


def _value(key: str, overrides: Sequence[str]) -> str:
    return next((item.partition("=")[2] for item in overrides if key.startswith(_key(item))), "")
