"""How the step size or the exploration changes from episode to episode.

A schedule maps the initial value and the number of episodes finished to the value of the next one.
No schedule (None) keeps the initial value.
"""

from __future__ import annotations

from typing import Protocol

from fieldrl.core import checks
from fieldrl.core.kinds import component


class Schedule(Protocol):
    """``final`` is the limit that the value tends to."""

    @property
    def final(self) -> float:
        """Where it ends."""
        ...

    def value(self, initial: float, episode: int) -> float:
        """The value in an episode, 0 being the first."""
        ...


@component
class Linear:
    """A straight line from the initial value to ``final``.

    Args:
        final: the value from episode ``episodes`` on, >= 0.
        episodes: how many episodes it takes, >= 1.
    """

    final: float
    episodes: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "final", checks.not_negative("final", self.final))
        checks.integer("episodes", self.episodes, 1)

    def value(self, initial: float, episode: int) -> float:
        """The value in an episode, 0 being the first."""
        return initial + (self.final - initial) * min(episode / self.episodes, 1.0)


@component
class Exponential:
    """The distance to ``final`` shrinks by the factor ``rate`` with every episode.

    Args:
        rate: in [0, 1].
        final: the limit, >= 0.
    """

    rate: float
    final: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "rate", checks.between("rate", self.rate, 0, 1))
        object.__setattr__(self, "final", checks.not_negative("final", self.final))

    def value(self, initial: float, episode: int) -> float:
        """The value in an episode, 0 being the first."""
        return self.final + (initial - self.final) * self.rate**episode
