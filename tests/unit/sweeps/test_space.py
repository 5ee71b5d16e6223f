"""Hydra's syntax for spaces, as the search reads it."""

from __future__ import annotations

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from fieldrl.cli.sweep_overrides import space
from fieldrl.core.checks import FieldrlError
from fieldrl.sweeps.space import Dimension


def read(*overrides: str):
    return space(OverridesParser.create().parse_overrides(list(overrides)))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("a=interval(0,1)", Dimension("a", 0.0, 1.0)),
        ("a=int(interval(1,5))", Dimension("a", 1, 5, whole=True)),
        ("a=tag(log,interval(1e-3,1))", Dimension("a", 1e-3, 1.0, log=True)),
        ("a=int(tag(log,interval(1,100)))", Dimension("a", 1, 100, whole=True, log=True)),
        ("a=range(1,4)", Dimension("a", choices=("1", "2", "3"), ordered=True)),
        ("a=4,1,2", Dimension("a", choices=("1", "2", "4"), ordered=True)),
        ("a=choice(y,x)", Dimension("a", choices=("y", "x"))),
        ("a=choice([1,2],[3,4])", Dimension("a", choices=("[1,2]", "[3,4]"))),
    ],
)
def test_a_space_is_read(text, wanted):
    assert read(text).dimensions == (wanted,)


def test_other_overrides_stay_and_of_a_key_given_twice_the_last_counts():
    found = read("episodes=3", "a=1,2", "b=interval(0,1)", "a=7", "+c=x,y")
    assert found.fixed == ("episodes=3", "a=7")
    assert [dimension.key for dimension in found.dimensions] == ["b", "+c"]
    assert found.keys == ("b", "c")
    assert found.overrides((0.25, 1)) == ("episodes=3", "a=7", "b=0.25", "+c=y")


def test_a_point_is_found_again_from_what_was_typed():
    found = read("a=interval(0,1)", "b=int(interval(1,5))", "c=x,y", "d=1,2,4")
    point = (0.123456, 3, 1, 2)
    assert found.point(["0.123456", "3", "y", "4"]) == point
    assert found.point(["2", "3", "y", "4"]) is None
    assert found.point(["0.1", "3", "z", "4"]) is None
    assert found.point(["0.1", "3"]) is None


def test_numbers_have_few_digits_and_stay_inside():
    assert Dimension("a", 0.0, 1.0).rounded(0.123456789) == 0.123457
    assert Dimension("a", 0.0, 0.99999999).rounded(0.99999998) == 0.99999999


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["a=interval(5,1)"], ["a=interval(5,1)", "below its end"]),
        (["a=interval(0,inf)"], ["a=inf", "finite"]),
        (["a=tag(log,interval(0,1))"], ["a=interval(0,1)", "above 0"]),
        (["a=1"], ["no key is searched", "interval"]),
    ],
)
def test_an_impossible_space_is_refused(overrides, words):
    with pytest.raises(FieldrlError) as caught:
        read(*overrides)
    assert all(word in str(caught.value) for word in words), str(caught.value)
