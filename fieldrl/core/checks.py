"""Error types of fieldrl and the argument checks that raise them.

A component is a frozen dataclass whose ``__post_init__`` calls these checks, so that a bad value is
refused before anything runs. Each message names the key, the value, the rule, its unit and the way out.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np

SMALLEST = 1e-30
"""Of a number that must be positive."""

MOST = 2**63 - 1
"""Of a whole number: what 64 bits hold."""


class FieldrlError(Exception):
    """Base of every error that fieldrl raises on purpose."""


class InvalidValue(FieldrlError, ValueError):
    """A value that breaks a component's rule.

    Args:
        key: name of the offending field, relative to its component.
        value: what was given.
        rule: what it must be ("must be > 0").
        unit: physical unit, or "" where there is none.
        remedy: a way out, or "".
    """

    def __init__(self, key: str, value: Any, rule: str, unit: str = "", remedy: str = "") -> None:
        super().__init__(key, value, rule, unit, remedy)
        self.key, self.value, self.rule, self.unit, self.remedy = key, value, rule, unit, remedy

    def __str__(self) -> str:
        unit = f" [{self.unit}]" if self.unit else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{self.key}={show(self.value)}: {self.rule}{unit}{remedy}"

    def within(self, prefix: str) -> InvalidValue:
        """The same error with its key below ``prefix`` ("vehicle" and "start" give "vehicle.start")."""
        key = ".".join(part for part in (prefix, self.key) if part)
        return InvalidValue(key, self.value, self.rule, self.unit, self.remedy)

    def renamed(self, part: str, name: str) -> InvalidValue:
        """The same error with the first ``part`` of its key called ``name``."""
        first, dot, rest = self.key.partition(".")
        key = f"{name}{dot}{rest}" if first == part else self.key
        return InvalidValue(key, self.value, self.rule, self.unit, self.remedy)


class SolveFailed(FieldrlError, ArithmeticError):
    """A forward solve that went unstable or non-finite.

    Args:
        theta: the parameters that were tried, (p,).
        time: model time at which the solve failed [time].
        reason: what was seen.
    """

    def __init__(self, theta: Sequence[float], time: float, reason: str) -> None:
        super().__init__(theta, time, reason)
        self.theta, self.time, self.reason = tuple(float(value) for value in theta), float(time), reason

    def __str__(self) -> str:
        theta = ", ".join(f"{value:.6g}" for value in self.theta)
        return f"forward solve failed at theta=({theta}), t={self.time:.6g}: {self.reason}"


def show(value: Any) -> str:
    """A short text of ``value`` for an error message."""
    text = str(value.tolist() if isinstance(value, np.ndarray) else value)
    return text if len(text) <= 60 else text[:57] + "..."


def number(key: str, value: Any, unit: str = "") -> float:
    """``value`` as a finite float; raises InvalidValue otherwise."""
    if not finite(value):
        raise InvalidValue(key, value, "must be a finite number", unit)
    return float(value)


def positive(key: str, value: Any, unit: str = "") -> float:
    """``value`` as a finite float > 0."""
    checked = _ranged(key, value, unit, "must be > 0", lambda x: x > 0)
    if checked < SMALLEST:  # what is divided by it would overflow
        raise InvalidValue(key, value, f"must be >= {SMALLEST:g}", unit)
    return checked


def not_negative(key: str, value: Any, unit: str = "") -> float:
    """``value`` as a finite float >= 0."""
    checked = _ranged(key, value, unit, "must be >= 0", lambda x: x >= 0)
    if 0.0 < checked < SMALLEST:
        raise InvalidValue(key, value, f"must be 0 or >= {SMALLEST:g}", unit)
    return checked


def at_least(key: str, value: Any, least: float, unit: str = "") -> float:
    """``value`` as a finite float >= ``least``."""
    return _ranged(key, value, unit, f"must be >= {least:g}", lambda x: x >= least)


def between(key: str, value: Any, low: float, high: float, unit: str = "") -> float:
    """``value`` as a finite float in the closed interval [low, high]."""
    return _ranged(key, value, unit, f"must lie in [{low:g}, {high:g}]", lambda x: low <= x <= high)


def integer(key: str, value: Any, least: int | None = None) -> int:
    """``value`` as an int, not below ``least``."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise InvalidValue(key, value, "must be a whole number")
    if least is not None and value < least:
        raise InvalidValue(key, value, f"must be >= {least}")
    if not -MOST <= int(value) <= MOST:
        raise InvalidValue(key, value, f"must be at most {MOST} in size")
    return int(value)


def boolean(key: str, value: Any) -> bool:
    """``value`` as a bool."""
    if not isinstance(value, bool | np.bool_):
        raise InvalidValue(key, value, "must be true or false")
    return bool(value)


def one_of(key: str, value: Any, choices: Collection[str]) -> str:
    """``value`` if it is one of ``choices``."""
    if not isinstance(value, str) or value not in choices:
        raise InvalidValue(key, value, f"must be one of {', '.join(choices)}")
    return value


def vector(key: str, value: Any, size: int | None, unit: str = "") -> tuple[float, ...]:
    """``value`` as a tuple of ``size`` finite floats (of any length where ``size`` is None)."""
    rule = "must be a list of numbers" if size is None else f"must be a list of {size} finite numbers"
    if (
        isinstance(value, str | bytes)
        or not isinstance(value, Sequence | np.ndarray)
        or getattr(value, "ndim", 1) == 0
    ):
        raise InvalidValue(key, value, rule, unit)
    if size is not None and len(value) != size:
        raise InvalidValue(key, value, rule, unit)
    if not all(finite(x) for x in value):
        raise InvalidValue(key, value, rule, unit)
    return tuple(float(x) for x in value)


def truth(key: str, value: Any, size: int, unit: str = "") -> tuple[float | None, ...]:
    """``value`` as a tuple of ``size`` finite floats, or None where they are unknown (null or NaN)."""
    if value is None:
        return (None,) * size
    listed = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)
    if not listed or np.ndim(value) == 0 or len(value) != size:
        raise InvalidValue(key, value, f"must be a list of {size} finite numbers, null where unknown", unit)
    unknown = [item is None or (isinstance(item, float) and math.isnan(item)) for item in value]
    known = vector(
        key, [0.0 if skip else item for item, skip in zip(value, unknown, strict=True)], size, unit
    )
    return tuple(None if skip else item for item, skip in zip(known, unknown, strict=True))


def interval(key: str, value: Any, unit: str = "") -> tuple[float, float]:
    """``value`` as a pair (low, high) with low < high."""
    low, high = vector(key, value, 2, unit)
    if not low < high:
        raise InvalidValue(key, value, "must be [low, high] with low < high", unit)
    return low, high


def ordered_bounds(
    lower: Sequence[float], upper: Sequence[float], true: Sequence[float | None], unit: str
) -> None:
    """Check ``lower`` < ``true`` < ``upper`` in every component whose true value is known."""
    if not all(low < high for low, high in zip(lower, upper, strict=True)):
        raise InvalidValue("upper", list(upper), f"must exceed lower={list(lower)} in every component", unit)
    if not all(value is None or a < value < b for a, value, b in zip(lower, true, upper, strict=True)):
        remedy = f"widen lower={list(lower)} and upper={list(upper)}, or move it"
        raise InvalidValue("true", list(true), "must lie inside the bounds", unit, remedy)


def finite(value: Any) -> bool:
    """Is ``value`` a number that a float can hold?"""
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _ranged(key: str, value: Any, unit: str, rule: str, holds) -> float:
    try:
        checked = number(key, value, unit)
    except InvalidValue as error:
        raise InvalidValue(key, value, f"{rule} and a finite number", unit) from error
    if not holds(checked):
        raise InvalidValue(key, value, rule, unit)
    return checked
