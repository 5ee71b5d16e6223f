"""What jobs are compared by: any number of summary.json, by its dotted path."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any

from fieldrl.core import checks
from fieldrl.core.checks import InvalidValue

DIRECTIONS = ("minimise", "maximise")
_ERRORS = ("e_f", "e_cv", "e_total", "field_rmse", "forward_solves")
_GREEDY = ("return", "e_f", "e_cv", "e_total")


@dataclass(frozen=True)
class Objective:
    """A number of summary.json and whether less of it is better.

    Args:
        path: dotted: "late_e_total", "theta_error", "parameters.mu.estimate", "greedy.return". A step into a
            list takes every item; "replicates_table.e_total" is e_total of every replicate.
        direction: minimise or maximise.
    """

    path: str
    direction: str

    def __post_init__(self) -> None:
        checks.one_of("hydra.sweeper.direction", self.direction, DIRECTIONS)

    def check(self, known: Collection[str]) -> None:
        """Refuse a path that no summary of these runs will have; ``known``: see ``known_paths``."""
        if self.path not in known:
            remedy = f"choose one of {', '.join(sorted(known))}"
            raise InvalidValue(
                "hydra.sweeper.objective", self.path, "no such number in summary.json", remedy=remedy
            )

    def values(self, summary: Mapping[str, Any]) -> tuple[float, ...]:
        """Every finite number at the path: one, or one for each item of a list."""
        return tuple(float(value) for value in _at(summary, self.path) if _finite(value))

    def value(self, summary: Mapping[str, Any]) -> float | None:
        """Median of the numbers at the path; None where there is none."""
        found = self.values(summary)
        return median(found) if found else None

    def loss(self, value: float) -> float:
        """The value with its sign turned where more is better."""
        return value if self.direction == "minimise" else -value


def known_paths(parameters: Collection[str], true: bool, greedy: bool) -> list[str]:
    """The paths that lead to numbers of results.

    Args:
        parameters: their names.
        true: whether true values are known.
        greedy: whether there are evaluation episodes.
    """
    each = [*_ERRORS, *(["theta_error"] if true else [])]
    each += [f"parameters.{name}.estimate" for name in parameters]
    each += [f"pooled.parameters.{name}.estimate" for name in parameters]
    paths = ["late_e_total", *each, *(f"replicates_table.{path}" for path in each)]
    if greedy:
        paths += [f"greedy.{name}" for name in (*_GREEDY, *(["theta_error"] if true else []))]
    return paths


def _at(content: Any, path: str) -> list[Any]:
    """What stands at a dotted path, of every item where there are lists; nothing where it leads nowhere."""
    if isinstance(content, list):
        return [found for item in content for found in _at(item, path)]
    if not path:
        return [content]
    head, _, rest = path.partition(".")
    return _at(content[head], rest) if isinstance(content, Mapping) and head in content else []


def _finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
