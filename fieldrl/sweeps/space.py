"""What ``hydra/sweeper=gp`` searches; ``cli/sweep_overrides.py`` reads it from Hydra's own syntax.

| written | searched |
|---------|----------|
| ``KEY=interval(a,b)`` | a real number, a <= x <= b |
| ``KEY=int(interval(a,b))`` | a whole number, both ends included |
| ``KEY=tag(log,interval(a,b))`` | the same, by its logarithm |
| ``KEY=range(a,b,step)``, ``KEY=1,2,4`` | one of these numbers; neighbours are alike |
| ``KEY=choice(x,y)``, ``GROUP=x,y`` | one of these words |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue

Point = tuple[Any, ...]
"""A value for each dimension: a number of an interval, or the place in a list of choices."""

_DIGITS = 6  # significant digits of a proposed number: what a person can type again


@dataclass(frozen=True)
class Dimension:
    """One key that is searched.

    Args:
        key: as it is overridden.
        low: least value, of an interval.
        high: greatest value, of an interval.
        whole: whether only whole numbers count.
        log: whether the logarithm is searched.
        choices: every value as text, where there is a list of them; low and high do not count then.
        ordered: whether the choices are numbers, by size.
    """

    key: str
    low: float = 0.0
    high: float = 1.0
    whole: bool = False
    log: bool = False
    choices: tuple[str, ...] = ()
    ordered: bool = False

    def __post_init__(self) -> None:
        if self.choices:
            return
        checks.number(self.key, self.low)
        checks.number(self.key, self.high)
        written = f"interval({self.low:g},{self.high:g})"
        if not self.low < self.high:
            raise InvalidValue(self.key, written, "must begin below its end")
        if self.log and self.low <= 0:
            raise InvalidValue(self.key, written, "must begin above 0 where the logarithm is searched")

    def rounded(self, value: Any) -> Any:
        """The value as it will be typed: few digits, inside the bounds."""
        if self.choices or self.whole:
            return int(value)
        return min(max(float(f"{value:.{_DIGITS}g}"), self.low), self.high)

    def text(self, value: Any) -> str:
        """The value as it is typed."""
        return self.choices[int(value)] if self.choices else f"{value!r}"

    def value(self, text: str) -> Any:
        """What was typed, as the value; None where it is none of this dimension's."""
        if self.choices:
            return self.choices.index(text) if text in self.choices else None
        try:
            number = float(text)
        except ValueError:
            return None
        if not self.low <= number <= self.high:
            return None
        return int(number) if self.whole else number


@dataclass(frozen=True)
class Space:
    """What is searched, and what stays.

    Args:
        dimensions: the keys that are searched, (d,).
        fixed: the other overrides.
    """

    dimensions: tuple[Dimension, ...]
    fixed: tuple[str, ...]

    def __post_init__(self) -> None:
        if not self.dimensions:
            raise FieldrlError("hydra/sweeper=gp: no key is searched; write one as 'KEY=interval(a,b)'")

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that are searched, without + and ~."""
        return tuple(dimension.key.lstrip("+~") for dimension in self.dimensions)

    def overrides(self, point: Point) -> tuple[str, ...]:
        """The overrides of a job at a point."""
        pairs = zip(self.dimensions, point, strict=True)
        return (*self.fixed, *(f"{dimension.key}={dimension.text(value)}" for dimension, value in pairs))

    def point(self, values: Sequence[str]) -> Point | None:
        """The point of values as text, (d,); None where one of them is not of this space."""
        if len(values) != len(self.dimensions):
            return None
        found = tuple(dimension.value(text) for dimension, text in zip(self.dimensions, values, strict=True))
        return None if any(value is None for value in found) else found


def of_choices(key: str, choices: Sequence[str]) -> Dimension:
    """A dimension of words, or of numbers by size where all of them are."""
    unique = list(dict.fromkeys(choices))
    numbers = [_number(text) for text in unique]
    if all(number is not None for number in numbers):
        ordered = [text for _, text in sorted(zip(numbers, unique, strict=True))]
        return Dimension(key, choices=tuple(ordered), ordered=True)
    return Dimension(key, choices=tuple(unique))


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None
