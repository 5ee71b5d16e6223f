"""From a checked configuration to the mission of a run, every component built before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fieldrl.app import config as configuration
from fieldrl.mission import Mission

_BUDGET = ("episodes", "steps", "evaluation_episodes")


def mission(config: Mapping[str, Any], solves: Path | None = None) -> Mission:
    """The mission of a configuration.

    Args:
        config: plain and checked.
        solves: where a model that can keep its solves on disk does so, unless the configuration says where.

    Raises:
        InvalidValue: with the full key of the value that a component, or the mission as a whole, refuses.
    """
    if solves is not None:
        config = {**config, "pde": _keeping(config["pde"], solves)}
    built = {
        name: configuration.build(config[name], name)
        for name in ("pde", "vehicle", "agent", "estimator", "reward")
    }
    return Mission(water=built.pop("pde"), **built, **{key: config[key] for key in _BUDGET})


def _keeping(pde: Mapping[str, Any], solves: Path) -> Mapping[str, Any]:
    """The configuration of a model, with a folder for its solves where it has none."""
    store = pde.get("solutions")
    if not isinstance(store, Mapping) or store.get("directory") is not None:
        return pde
    return {**pde, "solutions": {**store, "directory": str(solves)}}
