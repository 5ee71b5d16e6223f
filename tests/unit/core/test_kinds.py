"""Components refuse parts of the wrong kind, whatever their fields declare."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import is_dataclass
from typing import Protocol

import numpy as np
import pytest

from fieldrl.cli.compose import composed
from fieldrl.core import checks, kinds
from fieldrl.core.checks import InvalidValue
from fieldrl.core.kinds import component
from fieldrl.runs import components, options


class Engine(Protocol):
    """What a car needs."""

    power: float

    def start(self, key: str) -> bool: ...


class Diesel:
    """Somebody else's engine, which knows nothing of ours."""

    power = 3.0

    def start(self, key: str) -> bool:
        return True


@component
class Wheel:
    radius: float = 1.0


@component
class Car:
    engine: Engine
    wheels: Sequence[Wheel] = ()
    spare: Wheel | None = None
    seats: int = 4
    weight: float = 1.0
    name: str = "car"
    old: bool = False
    lengths: Sequence[float] = (1.0, 2.0)
    tiles: Sequence[int] | int = 3

    def __post_init__(self) -> None:
        checks.positive("weight", self.weight, "kg")


GOOD = [
    {},
    {"wheels": [Wheel(), Wheel(2)]},
    {"spare": Wheel()},
    {"seats": np.int64(3), "weight": np.float32(2), "old": np.True_},
    {"lengths": np.array([1.0, 2.0])},
    {"tiles": [1, 2]},
]
BAD = [
    ("engine", True), ("engine", {}), ("engine", "diesel"), ("engine", None), ("engine", 3),
    ("wheels", None), ("wheels", Wheel()), ("wheels", [Wheel(), 3]), ("wheels", "ab"),
    ("spare", 0), ("spare", {"radius": 1}),
    ("seats", 1.0), ("seats", True), ("seats", "4"), ("seats", 2**63), ("seats", -(2**70)), ("seats", [1]),
    ("weight", "1"), ("weight", [1.0]), ("weight", {}), ("weight", np.nan), ("weight", 1e22),
    ("weight", 10**22), ("weight", 1e-300), ("name", 3), ("name", None), ("old", 1), ("old", "true"),
    ("lengths", 1.0), ("lengths", [1, None]), ("lengths", [1, "2"]), ("lengths", [1, 1e308]),
    ("lengths", {1: 2}),
    ("tiles", 1.5), ("tiles", [1.5]),
]  # fmt: skip


@pytest.mark.parametrize("given", GOOD, ids=str)
def test_what_is_of_its_kind_is_taken(given):
    assert is_dataclass(Car(Diesel(), **given))


@pytest.mark.parametrize(("key", "value"), BAD, ids=str)
def test_what_is_not_of_its_kind_is_refused_by_its_key(key, value):
    with pytest.raises(InvalidValue) as error:
        Car(**({"engine": Diesel()} | {key: value}))
    assert error.value.key == key
    assert len(str(error.value).splitlines()) == 1


def test_the_message_says_what_is_lacking():
    with pytest.raises(InvalidValue, match="must be an Engine; it lacks power, start"):
        Car(engine=True)


def test_a_check_of_the_component_itself_has_the_first_word_on_numbers():
    with pytest.raises(InvalidValue, match=r"must be > 0 and a finite number \[kg\]"):
        Car(Diesel(), weight="heavy")


def test_infinite_numbers_are_no_numbers():
    for value in (np.inf, -np.inf, np.nan):
        with pytest.raises(InvalidValue):
            Wheel(value)


def test_a_property_of_a_part_is_not_evaluated_to_see_whether_it_is_there():
    class Costly(Diesel):
        @property
        def power(self) -> float:
            raise RuntimeError("evaluated")

    assert Car(Costly()).seats == 4


GROUPS = ("pde", "vehicle", "agent", "estimator", "reward", "parallel", "tracking")
OPTIONS = [f"{group}={option}" for group in GROUPS for option in options.options(group) if option != "dask"]
STRANGE = (object(), {"a": 1}, [object()], b"bytes", 1j)


def components_in(node):
    """Every node with a _target_ in a configuration."""
    if isinstance(node, dict):
        for value in node.values():
            yield from components_in(value)
        if "_target_" in node:
            yield node


@pytest.mark.parametrize("option", OPTIONS)
def test_no_argument_of_any_component_may_be_an_arbitrary_object(option):
    for node in components_in(composed([option])[option.partition("=")[0]]):
        for key in node:
            for value in STRANGE if key != "_target_" else ():
                with pytest.raises(InvalidValue) as error:
                    components.build(node | {key: value}, "here")
                assert error.value.key.startswith(f"here.{key}")


def test_declared_types_are_read_once():
    assert kinds.declared(Car) is kinds.declared(Car)
