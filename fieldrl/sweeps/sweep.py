"""A sweep is its overrides: the same command has the same key, the same folder, the same MLflow parent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fieldrl.runs.folder import ResultFolder
from fieldrl.runs.identity import WITHOUT_EFFECT, key


class Sweep(ResultFolder):
    """A sweep and its place on disk: its table, its pictures, the trials of a search."""

    kind = "sweeps"

    @property
    def name(self) -> str:
        """<experiment>-sweep-<key>."""
        return f"{self.experiment}-sweep-{self.key}"


def identity(arguments: Sequence[str], method: Mapping[str, Any]) -> str:
    """The key of a sweep.

    Args:
        arguments: overrides as typed, in any order; those that cannot change a result do not count.
        method: settings of the sweeper that decide which jobs there are.
    """
    return key(sorted(text for text in arguments if _group(text) not in WITHOUT_EFFECT), dict(method))


def _group(override: str) -> str:
    """``agent`` of "+agent.step_size=0.5"."""
    return override.partition("=")[0].lstrip("+~").partition(".")[0]
