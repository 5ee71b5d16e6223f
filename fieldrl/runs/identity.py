"""A run is its configuration, a sweep its overrides: the same results have the same key."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from fieldrl.runs import contents

RESULTS = 3
"""Version of the results: raise it when the same configuration gives other numbers than before."""

WITHOUT_EFFECT = (
    "output_dir", "force", "parallel", "tracking", "pde.solutions", "pde.reduced_models", "estimator.workers",
)  # fmt: skip
"""Keys that cannot change a result, and so are no part of a run's identity."""


_LATER = {"unknown": None, "stop": None, "posterior": None, "cross_validation": "every_step"}
"""Keys that are no part of it while they have this value, or none."""


def identity(config: Mapping[str, Any]) -> str:
    """The key of a configuration: of what is written in it, and of what it names (see ``contents``)."""
    effective = _effective(config)
    other = contents.code(effective)
    return key(_canonical(contents.with_contents(effective)), *([other] if other else ()))


def key(*content: Any) -> str:
    """Ten hexadecimal digits of a hash of plain values and of the version of the results."""
    text = json.dumps([RESULTS, *content], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:10]


def _effective(config: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """The nested keys of ``config`` that can change a result."""
    found = {key: value for key, value in config.items() if f"{path}{key}" not in WITHOUT_EFFECT}
    if not path:  # as before there were such keys
        found = {
            key: value
            for key, value in found.items()
            if key not in _LATER or (value and value != _LATER[key])
        }
    return {
        key: _effective(value, f"{path}{key}.") if isinstance(value, Mapping) else value
        for key, value in found.items()
    }


def _canonical(value: Any) -> Any:
    """``value`` with 10.0 and 10 made equal."""
    if isinstance(value, Mapping):
        return {str(key): _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value
