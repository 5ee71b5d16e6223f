"""The configuration of a run: which groups and keys it has, as plain values, and the files that say so."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import yaml

from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.runs import trust
from fieldrl.runs.options import options

GROUPS = (
    "pde", "scenario", "vehicle", "agent", "observation", "estimator", "reward", "parallel", "tracking",
)  # fmt: skip
OPTIONAL = ("posterior",)
"""Groups of which no option need be chosen."""

KEYS = (
    "seed",
    "replicates",
    "episodes",
    "steps",
    "evaluation_episodes",
    "cross_validation",
    "stop",
    "unknown",
    "output_dir",
    "force",
)
_LEAST = {"seed": 0, "replicates": 1, "episodes": 1, "steps": 1, "evaluation_episodes": 0}


@dataclass(frozen=True)
class Composed:
    """The configuration of a run, as it was composed.

    Args:
        config: plain, interpolations resolved; not yet checked.
        experiment: the chosen option of the group ``experiment``.
        overrides: what made it.
        hydra: Hydra's own settings, as YAML.
    """

    config: dict[str, Any]
    experiment: str
    overrides: tuple[str, ...] = ()
    hydra: str = ""

    def files(self) -> dict[str, str]:
        """Content of ``.hydra/`` by file name."""
        files = {
            "config.yaml": yaml.safe_dump(self.config, sort_keys=False),
            "hydra.yaml": self.hydra,
            "overrides.yaml": yaml.safe_dump(list(self.overrides)),
        }
        return {name: text for name, text in files.items() if text}


def check(config: Mapping[str, Any]) -> None:
    """Refuse unknown, missing and null groups and keys of the top level, and impossible numbers.

    Nor may it name a class that is not trusted; nothing of it has been imported then.
    """
    for key, value in config.items():
        if key not in (*GROUPS, *OPTIONAL, *KEYS):
            known = (*KEYS, *GROUPS, *OPTIONAL)
            raise InvalidValue(key, value, "unknown key", remedy=suggestion(key, known))
    for key in (*KEYS, *GROUPS):
        if key not in config:
            raise FieldrlError(f"{key}: is missing; leave out the override ~{key}")
    for group in (*GROUPS, *OPTIONAL):
        if group in GROUPS or config.get(group) is not None:
            _check_group(group, config[group])
    for key, least in _LEAST.items():
        checks.integer(key, config[key], least)
    checks.boolean("force", config["force"])
    if config["unknown"] is not None and not isinstance(config["unknown"], Mapping):
        rule = "must be a mapping of names, such as {mu: {true: .25, lower: 0, upper: .5}}"
        raise InvalidValue("unknown", config["unknown"], rule)
    if config["stop"] is not None and not (isinstance(config["stop"], Mapping) and config["stop"]):
        raise InvalidValue(
            "stop", config["stop"], "must be a mapping of unknowns to widths, such as {b_x: 0.1}"
        )
    if not isinstance(config["output_dir"], str) or not config["output_dir"]:
        raise InvalidValue("output_dir", config["output_dir"], "must be the path of a folder")
    trust.check_targets(config)


def _check_group(group: str, node: Any) -> None:
    if not isinstance(node, Mapping) or not node.get("_target_"):
        given = node if not isinstance(node, Mapping) else f"{group} without _target_"
        remedy = f"choose one of {', '.join(options(group))}"
        raise InvalidValue(group, given, "must be an option of this group", remedy=remedy)


def suggestion(key: str, known: Iterable[str]) -> str:
    """A way out for an unknown key: the nearest known one, or all of them."""
    known = list(known)
    near = difflib.get_close_matches(key, known, 1)
    if near:
        return f"did you mean {near[0]}?"
    return f"the keys here are {', '.join(known)}" if known else "there are no keys here"
