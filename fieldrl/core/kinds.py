"""Components: frozen dataclasses whose parts must be of the kind that their fields declare.

``@component`` reads the annotations, so that no component can forget a check. A field may declare a number,
truth value, text, list, class or Protocol, or a union of those; whoever has what a Protocol names is of its
kind, other people's classes included. What ``__post_init__`` checks itself (ranges) has the better messages:
it runs when the parts are known to be of their kinds, and before the values that it forgot are looked at.
"""

from __future__ import annotations

import math
import types
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields
from functools import lru_cache
from numbers import Integral
from typing import (
    Annotated,
    Any,
    Protocol,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np

from fieldrl.core.checks import MOST, InvalidValue, finite

LARGEST = 1e15  # of a number: its squares and their products stay finite

OR_NULL = "or null"
"""In Annotated: None may be given too, which ``__post_init__`` makes what is declared.

So may what has less than is declared: ``Annotated[Water, Model]``, with a Protocol in the same place.
"""

_VALUES = (float, int, bool, str)
_WORDS: dict[Any, tuple[str, str]] = {
    float: ("a finite number", "finite numbers"),
    int: ("a whole number", "whole numbers"),
    bool: ("true or false", "truth values"),
    str: ("text", "texts"),
    types.NoneType: ("null", "nulls"),
}

Kind = TypeVar("Kind", bound=type)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def component(kind: Kind) -> Kind:
    """Make a class a frozen dataclass that refuses parts of the wrong kind with InvalidValue."""
    own = getattr(kind, "__post_init__", None)

    def __post_init__(self: Any) -> None:
        check(type(self), vars(self), values_too=False)
        if own is not None:
            own(self)
        check(type(self), vars(self))

    kind.__post_init__ = __post_init__  # type: ignore[attr-defined]
    return dataclass(frozen=True)(kind)  # type: ignore[return-value]


def check(kind: type, values: dict[str, Any], values_too: bool = True) -> None:
    """Raises InvalidValue for the first of ``values`` that is not what a field of ``kind`` declares.

    Args:
        kind: a dataclass.
        values: by name of the field.
        values_too: look at numbers, truth values and texts too; without, only at how large numbers are.
    """
    for name, hint in declared(kind).items():
        if name in values:
            _check_size(name, values[name], hint)
            if values_too or not _mentions(hint, *_VALUES):
                check_part(name, values[name], hint)


def check_part(name: str, value: Any, hint: Any) -> None:
    """Raises InvalidValue(name, ...) where ``value`` is not what a type hint declares."""
    if not fits(value, hint):
        raise _refused(name, value, hint)


@lru_cache(maxsize=256)
def declared(kind: type) -> dict[str, Any]:
    """The types of the fields that a dataclass is constructed from, by name."""
    hints = get_type_hints(kind, include_extras=True)
    return {part.name: hints[part.name] for part in fields(kind) if part.init}


def fits(value: Any, hint: Any) -> bool:
    """Whether ``value`` is what a type hint declares; True for hints that say nothing about it."""
    if hint in (float, int):
        return finite(value) if hint is float else isinstance(value, Integral) and not isinstance(value, bool)
    if hint is bool:
        return isinstance(value, bool | np.bool_)
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        less = any(_is_protocol(one) and fits(value, one) for one in inner[1:])
        return less or (value is None and OR_NULL in inner) or fits(value, inner[0])
    if origin in (Union, types.UnionType):
        return any(fits(value, choice) for choice in inner)
    if origin is Sequence:
        listed = isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes)
        return listed and np.ndim(value) != 0 and all(fits(item, inner[0]) for item in value)
    if _is_protocol(hint):
        return not _lacking(value, hint)
    kind = origin or hint
    return isinstance(value, kind) if isinstance(kind, type) else True


def _refused(name: str, value: Any, hint: Any) -> InvalidValue:
    choices = _choices(hint)
    rule = f"must be {' or '.join(_words(choice) for choice in choices)}"
    protocols = [choice for choice in choices if _is_protocol(choice)]
    remedy = ""
    if protocols:
        what = protocols[0]
        rule += f"; it lacks {', '.join(_lacking(value, what))}"
        remedy = f"see {what.__module__}.{what.__name__}"
    return InvalidValue(name, value, rule, remedy=remedy)


def _check_size(name: str, value: Any, hint: Any) -> None:
    """Refuse numbers with which arithmetic overflows, in whatever they are listed."""
    if not _mentions(hint, float, int):
        return
    most = LARGEST if _mentions(hint, float) else MOST
    for number in _numbers(value):
        if not math.isinf(number) and abs(number) > most:
            raise InvalidValue(name, value, f"must be at most {most:g} in size", remedy="choose other units")


def _numbers(value: Any) -> Iterator[Any]:
    if isinstance(value, int | float | np.number) and not isinstance(value, bool):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _numbers(item)


def _choices(hint: Any) -> tuple[Any, ...]:
    if get_origin(hint) is Annotated:
        return tuple(one for one in get_args(hint) if _is_protocol(one))[1:] or (
            get_args(hint)[0],
            types.NoneType,
        )
    return get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)


def _mentions(hint: Any, *kinds: type) -> bool:
    return hint in kinds or any(_mentions(inner, *kinds) for inner in get_args(hint))


def _words(hint: Any) -> str:
    if hint in _WORDS:
        return _WORDS[hint][0]
    if get_origin(hint) is Sequence:
        inner = [_WORDS[each][1] if each in _WORDS else each.__name__ for each in _choices(get_args(hint)[0])]
        return f"a list of {' or '.join(inner)}"
    name = getattr(get_origin(hint) or hint, "__name__", str(hint))
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _is_protocol(hint: Any) -> bool:
    return isinstance(hint, type) and bool(getattr(hint, "_is_protocol", False))


def _lacking(value: Any, protocol: type) -> list[str]:
    """What a Protocol names and ``value`` has not. Properties of its class are not evaluated."""
    return [name for name in _members(protocol) if not _has(value, name)]


def _has(value: Any, name: str) -> bool:
    if name == "__call__":  # every class has one, that of its own kind
        return callable(value)
    return hasattr(type(value), name) or hasattr(value, name)


@lru_cache(maxsize=64)
def _members(protocol: type) -> tuple[str, ...]:
    bases = [base for base in protocol.__mro__ if _is_protocol(base) and base is not Protocol]
    named = {name for base in bases for name in (*vars(base), *vars(base).get("__annotations__", ()))}
    return tuple(sorted(name for name in named if name == "__call__" or not name.startswith("_")))
