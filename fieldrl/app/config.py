"""The composed configuration: where it comes from, which keys it may have, what it builds.

A component's constructor is its schema: the keys of a node with ``_target_`` are the target's arguments.
Everything is checked and every component built before anything is computed or written.
"""

from __future__ import annotations

import difflib
import importlib
import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import MissingMandatoryValue, OmegaConfBaseException

from fieldrl.app.places import options
from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue

GROUPS = ("pde", "vehicle", "agent", "estimator", "reward", "parallel", "tracking")
KEYS = ("seed", "replicates", "episodes", "steps", "evaluation_episodes", "output_dir", "force")
_LEAST = {"seed": 0, "replicates": 1, "episodes": 1, "steps": 1, "evaluation_episodes": 0}


def plain(config: DictConfig) -> dict[str, Any]:
    """The configuration as plain dicts and lists, interpolations resolved.

    Raises:
        FieldrlError: a value that must be given is missing, or an interpolation leads nowhere.
    """
    try:
        content = OmegaConf.to_container(config, resolve=True, throw_on_missing=True)
    except MissingMandatoryValue as error:
        raise InvalidValue(str(error.full_key), "???", "must be given") from error
    except OmegaConfBaseException as error:
        reason = str(error).splitlines()[0]
        raise FieldrlError(f"{error.full_key}: {reason}") from error
    return {str(key): value for key, value in dict(content).items()}  # type: ignore[arg-type]


def check(config: Mapping[str, Any]) -> None:
    """Refuse unknown, missing and null groups and keys of the top level, and impossible numbers."""
    for key, value in config.items():
        if key not in (*GROUPS, *KEYS):
            raise InvalidValue(key, value, "unknown key", remedy=suggestion(key, (*KEYS, *GROUPS)))
    for key in (*KEYS, *GROUPS):
        if key not in config:
            raise FieldrlError(f"{key}: is missing; leave out the override ~{key}")
    for group in GROUPS:
        _check_group(group, config[group])
    for key, least in _LEAST.items():
        checks.integer(key, config[key], least)
    checks.boolean("force", config["force"])
    if not isinstance(config["output_dir"], str) or not config["output_dir"]:
        raise InvalidValue("output_dir", config["output_dir"], "must be the path of a folder")


def build(node: Any, path: str) -> Any:
    """The component of a node with ``_target_``, built from the inside out; other values as they are.

    Args:
        node: a part of the plain configuration.
        path: its place in the configuration ("vehicle.sensor"), for error messages.

    Raises:
        InvalidValue: an unknown or missing key, or a value that the component refuses.
    """
    if isinstance(node, list):
        return [build(item, f"{path}.{i}") for i, item in enumerate(node)]
    if not isinstance(node, Mapping):
        return node
    arguments = {key: build(value, f"{path}.{key}") for key, value in node.items() if key != "_target_"}
    if "_target_" not in node:
        return arguments
    target = _locate(node["_target_"], path)
    _check_arguments(target, arguments, path)
    return _call(target, arguments, path)


def _call(target: Callable[..., Any], arguments: dict[str, Any], path: str) -> Any:
    try:
        return target(**arguments)
    except InvalidValue as error:
        raise error.within(path) from error
    except (TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise FieldrlError(f"{path}: {target.__name__} refuses these values: {reason}") from error


def _check_group(group: str, node: Any) -> None:
    if not isinstance(node, Mapping) or not node.get("_target_"):
        given = node if not isinstance(node, Mapping) else f"{group} without _target_"
        remedy = f"choose one of {', '.join(options(group))}"
        raise InvalidValue(group, given, "must be an option of this group", remedy=remedy)


def _check_arguments(target: Callable[..., Any], arguments: Mapping[str, Any], path: str) -> None:
    known = inspect.signature(target).parameters
    for key, value in arguments.items():
        if not isinstance(key, str):  # YAML reads a bare true, on or 1 as no text
            raise FieldrlError(f"{path}: the key {str(key).lower()} must be written in quotes in its file")
        if key not in known:
            raise InvalidValue(f"{path}.{key}", value, "unknown key", remedy=suggestion(key, known))
    for key, parameter in known.items():
        if parameter.default is parameter.empty and key not in arguments:
            raise FieldrlError(f"{path}.{key}: is missing; give it as {path}.{key}=VALUE")


def _locate(target: Any, path: str) -> Callable[..., Any]:
    try:
        module, _, name = str(target).rpartition(".")
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # whatever an import may raise
        raise InvalidValue(f"{path}._target_", target, "cannot be imported", remedy=_reason(error)) from error
    if not callable(found):
        raise InvalidValue(f"{path}._target_", target, "must be a class or a function")
    return found


def _reason(error: BaseException) -> str:
    """What an error says, on one line."""
    return " ".join(str(error).split())[:120]


def suggestion(key: str, known: Iterable[str]) -> str:
    """A way out for an unknown key: the nearest known one, or all of them."""
    known = list(known)
    near = difflib.get_close_matches(key, known, 1)
    if near:
        return f"did you mean {near[0]}?"
    return f"the keys here are {', '.join(known)}" if known else "there are no keys here"
