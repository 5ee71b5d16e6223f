"""Which Python names a configuration may load: those of the packages that the user allows, and no others.

The environment says which, not a key of the configuration: one that was taken from somebody else must not be
able to allow itself.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from fieldrl.core.checks import InvalidValue

VARIABLE = "FIELDRL_PACKAGES"
"""Names the packages, beside fieldrl, whose classes a configuration may name; separated by commas."""


def packages() -> tuple[str, ...]:
    """The packages that are allowed now."""
    listed = os.environ.get(VARIABLE, "").split(",")
    return ("fieldrl", *(name.strip() for name in listed if name.strip()))


def check_target(target: Any, path: str, also: Collection[str] = ()) -> None:
    """Refuse a Python name outside the allowed packages, without importing anything.

    Args:
        target: the name.
        path: where it stands in the configuration.
        also: further packages that are allowed here.

    Raises:
        InvalidValue: with the way to allow it.
    """
    root = str(target).partition(".")[0]
    if root not in (*packages(), *also):
        rule = f"is not imported: it is outside the packages allowed ({', '.join(packages())})"
        raise InvalidValue(path, target, rule, remedy=f"if you trust it: {VARIABLE}={root}")


def check_targets(config: Mapping[str, Any]) -> None:
    """``check_target`` for every ``_target_`` of a nested configuration."""
    for path, key, value in walk(config):
        if key == "_target_" and value:
            check_target(value, path)


def walk(node: Any, path: str = "") -> Iterator[tuple[str, str, Any]]:
    """(dotted path, key, value) of everything in nested dicts and lists."""
    items = node.items() if isinstance(node, Mapping) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        below = f"{path}.{key}" if path else str(key)
        yield below, str(key), value
        yield from walk(value, below)
