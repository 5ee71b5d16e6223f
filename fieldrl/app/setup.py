"""From a checked configuration to the mission of a run, every component built before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fieldrl.app import config as configuration
from fieldrl.mission import Mission

_BUDGET = ("episodes", "steps", "evaluation_episodes")


def mission(config: Mapping[str, Any]) -> Mission:
    """The mission of a configuration.

    Raises:
        InvalidValue: with the full key of the value that a component, or the mission as a whole, refuses.
    """
    built = {
        name: configuration.build(config[name], name)
        for name in ("pde", "vehicle", "agent", "estimator", "reward")
    }
    return Mission(water=built.pop("pde"), **built, **{key: config[key] for key in _BUDGET})
