"""What does not fit in memory, or takes for ever, is refused before it starts; what takes long is told."""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

from fieldrl.core.checks import FieldrlError, show
from fieldrl.core.cost import Cost

PROCESS = 250e6  # memory of a process that has imported everything [bytes]
_HOUR, _YEAR = 3600.0, 365.25 * 24 * 3600.0
LONG, FOR_EVER = 2 * _HOUR, 10 * _YEAR
_UNITS = ((_YEAR, "years"), (24 * _HOUR, "days"), (_HOUR, "h"), (60.0, "min"), (0.0, "s"))
_CONTROL_GROUP = Path("/sys/fs/cgroup")


class LongRun(UserWarning):
    """A run that is estimated to take hours."""


def check(needs: Mapping[str, Cost], config: Mapping[str, Any], processes: int) -> None:
    """Refuse or announce a run by what it is estimated to take.

    Args:
        needs: of each part, all processes together; see ``fieldrl.mission.needs``.
        config: plain and checked.
        processes: how many replicates are computed at a time.

    Raises:
        FieldrlError: it does not fit in the memory that is available, or takes more than ten years.
    """
    memory = processes * PROCESS + sum(cost.memory for cost in needs.values())
    seconds = sum(cost.seconds for cost in needs.values())
    free = available()
    if memory > free:
        most = max(needs, key=lambda name: needs[name].memory)
        way_out = "; parallel.jobs=1 needs less" if processes > 1 else ""
        raise FieldrlError(
            f"the run needs about {_bytes(memory)} of memory, {_bytes(free)} are available; "
            f"most of it follows from\n{_settings(most, needs, config)}: lower these{way_out}"
        )
    most = max(needs, key=lambda name: needs[name].seconds)
    if seconds > LONG:
        text = f"the run is estimated to take {duration(seconds)}; most of it follows from"
        settings = _settings(most, needs, config)
        if seconds > FOR_EVER:
            raise FieldrlError(f"{text}\n{settings}: lower these")
        warnings.warn(f"{text} {settings}", LongRun, stacklevel=2)


def available() -> float:
    """Memory that this process and its workers may still take [bytes].

    The least of what the machine has free and what limits of the process and its control group leave.
    """
    free = float(psutil.virtual_memory().available)
    with suppress(ImportError, AttributeError):  # not on every system
        resource = importlib.import_module("resource")
        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            free = min(free, limit - psutil.Process().memory_info().vms)
    try:
        used, most = ((_CONTROL_GROUP / name).read_text() for name in ("memory.current", "memory.max"))
        free = min(free, float(most) - float(used))
    except (OSError, ValueError):  # no such limit
        pass
    return max(free, 0.0)


def _settings(part: str, needs: Mapping[str, Cost], config: Mapping[str, Any]) -> str:
    """The settings that a part's cost grows with, and the budget of the run, as KEY=VALUE."""
    group = "pde" if part == "water" else part
    keys = needs["record"].by if part == "record" else tuple(f"{group}.{key}" for key in needs[part].by)
    keys = tuple(dict.fromkeys((*keys, *needs["record"].by)))
    found = {key: _value(config, key) for key in keys}
    return " ".join(f"{key}={show(value)}" for key, value in found.items() if value is not None)


def _value(config: Any, key: str) -> Any:
    for part in key.split("."):
        config = config.get(part) if isinstance(config, Mapping) else None
    return config


def _bytes(size: float) -> str:
    for unit in ("MB", "GB", "TB"):
        size /= 1e3 if unit != "MB" else 1e6
        if size < 1000 or unit == "TB":
            break
    return f"{size:.3g} {unit}"


def duration(seconds: float) -> str:
    """A time in the unit that suits it."""
    length, unit = next((length, unit) for length, unit in _UNITS if seconds >= length)
    return f"{seconds / (length or 1.0):.3g} {unit}"
