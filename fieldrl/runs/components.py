"""Components from their configuration: a constructor is its schema, its arguments are the keys of the node.

Everything is checked and every component built before anything is computed or written.
"""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fieldrl.core import kinds
from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.mission import Mission
from fieldrl.mission.needs import BUDGET, needs
from fieldrl.parallel.workers import Workers
from fieldrl.runs import limits, trust
from fieldrl.runs.configuration import suggestion

_OWN = ("episodes", "steps", "evaluation_episodes", "stop", "cross_validation")


def mission(config: Mapping[str, Any], solves: Path | None = None) -> Mission:
    """The mission of a configuration.

    Args:
        config: plain and checked.
        solves: where a model that can keep its solves on disk does so, unless the configuration says where.

    Raises:
        InvalidValue: with the full key of the value that a component, or the mission as a whole, refuses.
    """
    names = ("vehicle", "agent", "estimator", "reward", "observation", "scenario")
    built = {"pde": model(config, solves), **{name: build(config[name], name) for name in names}}
    if config.get("posterior") is not None:
        built["posterior"] = build(config["posterior"], "posterior")
    parts = {"water": built.pop("pde"), **built, **{key: config[key] for key in _OWN}}
    try:
        kinds.check(Mission, parts)
        _check_needs(parts, config)
        return Mission(**parts)
    except InvalidValue as error:
        raise error.renamed("water", "pde") from error


def model(config: Mapping[str, Any], solves: Path | None = None) -> Any:
    """The forward model of a configuration, with the unknowns that it names.

    Args:
        config: plain and checked.
        solves: as for ``mission``.

    Raises:
        InvalidValue: with the full key of the value that the model refuses.
    """
    node, unknown = config["pde"], config["unknown"]
    if solves is not None:
        node = _keeping(node, solves)
    if not unknown:
        return build(node, "pde")
    if "unknown" not in inspect.signature(_class(node["_target_"], "pde._target_")).parameters:
        rule = "this model names its own unknowns, in its parameters"
        raise InvalidValue("unknown", dict(unknown), rule, remedy="leave out unknown")
    try:
        return build({**node, "unknown": unknown}, "pde")
    except InvalidValue as error:
        raise InvalidValue(
            error.key.removeprefix("pde.") if error.key.startswith("pde.unknown") else error.key,
            error.value, error.rule, error.unit, error.remedy,
        ) from error  # fmt: skip


def build(node: Any, path: str) -> Any:
    """The component of a node with ``_target_``, built from the inside out; other values as they are.

    Args:
        node: a part of the plain configuration.
        path: its place in the configuration ("vehicle.sensor"), for error messages.

    Raises:
        InvalidValue: a class that is not trusted, an unknown or missing key, or a value that the component
            refuses.
    """
    if isinstance(node, list):
        return [build(item, f"{path}.{i}") for i, item in enumerate(node)]
    if not isinstance(node, Mapping):
        return node
    arguments = {key: build(value, f"{path}.{key}") for key, value in node.items() if key != "_target_"}
    if "_target_" not in node:
        return arguments
    target = _class(node["_target_"], f"{path}._target_")
    _check_arguments(target, arguments, path)
    try:
        return target(**arguments)
    except InvalidValue as error:
        raise error.within(path) from error
    except (TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise FieldrlError(f"{path}: {target.__name__} refuses these values: {reason}") from error


def _check_needs(parts: Mapping[str, Any], config: Mapping[str, Any]) -> None:
    """Refuse what does not fit in memory or takes for ever; announce what takes long."""
    workers = build(config["parallel"], "parallel")
    processes = workers.processes(config["replicates"]) if isinstance(workers, Workers) else 1
    doing = {name: parts[name] for name in ("water", "vehicle", "agent", "estimator")}
    budget = {key: config[key] for key in BUDGET}
    limits.check(needs(**doing, budget=budget, processes=processes), config, processes)


def _keeping(pde: Mapping[str, Any], solves: Path) -> Mapping[str, Any]:
    """The configuration of a model, with a folder for its solves where it has none."""
    store = pde.get("solutions")
    if not isinstance(store, Mapping) or store.get("directory") is not None:
        return pde
    return {**pde, "solutions": {**store, "directory": str(solves)}}


def _check_arguments(target: type, arguments: Mapping[str, Any], path: str) -> None:
    known = inspect.signature(target).parameters
    for key, value in arguments.items():
        if not isinstance(key, str):  # YAML reads a bare true, on or 1 as no text
            raise FieldrlError(f"{path}: the key {str(key).lower()} must be written in quotes in its file")
        if key not in known:
            raise InvalidValue(f"{path}.{key}", value, "unknown key", remedy=suggestion(key, known))
    for key, parameter in known.items():
        if parameter.default is parameter.empty and key not in arguments:
            raise FieldrlError(f"{path}.{key}: is missing; give it as {path}.{key}=VALUE")


def _class(target: Any, path: str) -> type:
    """The class of that name, defined in a package that is trusted."""
    trust.check_target(target, path)
    try:
        module, _, name = str(target).rpartition(".")
        found = getattr(importlib.import_module(module), name)
    except Exception as error:  # whatever an import may raise
        reason = " ".join(str(error).split())[:120]
        raise InvalidValue(path, target, "cannot be imported", remedy=reason) from error
    if not isinstance(found, type):
        raise InvalidValue(path, target, "must be a class")
    trust.check_target(found.__module__, path)  # not one that a trusted module happens to import
    return found
