"""What a run will take: memory and time, estimated from settings alone before anything is computed.

Each component may tell its share by a method ``cost``; who has none counts as nothing. The figures are those
of one core of an ordinary machine of 2025; ``python -m pipelines.benchmarks.estimates`` compares them with
what is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

DOUBLE = 8  # bytes of a number


class Extent(NamedTuple):
    """How much one replicate does.

    Args:
        episodes: of learning and evaluation together.
        steps: samples of an episode.
        parameters: p, how many unknowns there are.
        actions: how many there are.
    """

    episodes: int
    steps: int
    parameters: int
    actions: int

    @property
    def samples(self) -> int:
        """Of all episodes."""
        return self.episodes * self.steps


@dataclass(frozen=True)
class Cost:
    """What something takes.

    Args:
        memory: at its peak [bytes].
        seconds: on one core [s].
        by: the settings that it grows with, below the component's key.
    """

    memory: float = 0.0
    seconds: float = 0.0
    by: tuple[str, ...] = ()

    def times(self, processes: int, rounds: int) -> Cost:
        """That of so many processes at a time, so many times."""
        return Cost(processes * self.memory, rounds * self.seconds, self.by)


def told(component: Any, *what: Any) -> Cost:
    """What a component tells of its cost, or nothing."""
    return component.cost(*what) if hasattr(component, "cost") else Cost()


def solve_seconds(model: Any, samples: int) -> float:
    """How long a model takes to predict one candidate at so many samples; 0 where it does not tell [s]."""
    return model.solve_seconds(samples) if hasattr(model, "solve_seconds") else 0.0
