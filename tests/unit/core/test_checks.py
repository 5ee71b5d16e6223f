"""The argument checks and the errors that they raise."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue, SolveFailed

NOT_NUMBERS = [True, "3", None, math.nan, math.inf, -math.inf, 1j, 10**400, [1.0], np.array([1.0])]


def refused(check, *args):
    with pytest.raises(InvalidValue) as error:
        check("key", *args)
    assert error.value.key == "key"
    return str(error.value)


def test_a_message_names_key_value_rule_unit_and_way_out():
    error = InvalidValue("max_speed", -1, "must be > 0", "length/time", "raise it")
    assert str(error) == "max_speed=-1: must be > 0 [length/time]; raise it"
    assert str(InvalidValue("n", 0, "must be >= 1")) == "n=0: must be >= 1"


def test_a_component_puts_its_name_before_the_key():
    error = InvalidValue("noise", -1, "must be >= 0").within("sensor").within("vehicle")
    assert error.key == "vehicle.sensor.noise"
    assert InvalidValue("seed", -1, "must be >= 0").within("").key == "seed"


@pytest.mark.parametrize(
    "error",
    [InvalidValue("a", 1, "b", "c", "d"), SolveFailed((0.1, 0.2), 3.0, "not finite"), FieldrlError("text")],
)
def test_errors_survive_the_way_back_from_a_worker(error):
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)


def test_errors_are_also_what_python_calls_them():
    assert isinstance(InvalidValue("a", 1, "b"), ValueError)
    assert isinstance(SolveFailed((1.0,), 0.0, "x"), ArithmeticError)


def test_a_failed_solve_says_where_it_failed():
    text = str(SolveFailed(np.array([0.25, 0.6]), 3.0, "not finite"))
    assert text == "forward solve failed at theta=(0.25, 0.6), t=3: not finite"


def test_long_values_are_cut():
    assert len(checks.show(list(range(1000)))) == 60
    assert checks.show(np.array([1.0, 2.0])) == "[1.0, 2.0]"


@settings(deadline=None)
@given(st.one_of(st.floats(allow_nan=False, allow_infinity=False), st.integers(-(2**53), 2**53)))
def test_every_finite_number_is_a_number(value):
    checked = checks.number("key", value)
    assert type(checked) is float
    assert checked == value


@pytest.mark.parametrize("value", [np.float64(2), np.float32(2), np.int64(2), 2])
def test_numpy_scalars_are_numbers(value):
    assert checks.number("key", value) == 2.0


@pytest.mark.parametrize("value", NOT_NUMBERS)
@pytest.mark.parametrize("check", [checks.number, checks.positive, checks.not_negative])
def test_what_is_no_finite_number_is_refused(check, value):
    assert "finite number" in refused(check, value)


def test_ranges_are_kept():
    assert "must be > 0" in refused(checks.positive, 0)
    assert checks.not_negative("key", 0) == 0.0
    assert "must be >= 0" in refused(checks.not_negative, -1e-300)
    assert "must be 0 or >= 1e-30" in refused(checks.not_negative, 1e-300)
    assert checks.at_least("key", 1, 1) == 1.0
    assert "must be >= 1" in refused(checks.at_least, 0.5, 1)
    assert checks.between("key", 1, 0, 1) == 1.0
    assert "must lie in [0, 1] [rad]" in refused(checks.between, 1.5, 0, 1, "rad")


def test_whole_numbers():
    assert checks.integer("key", np.int32(3), 1) == 3
    assert type(checks.integer("key", np.int32(3))) is int
    assert "must be >= 1" in refused(checks.integer, 0, 1)


@pytest.mark.parametrize("value", [1.0, True, "1", None, np.float64(1)])
def test_what_is_no_whole_number_is_refused(value):
    assert "whole number" in refused(checks.integer, value)


def test_truth_values():
    assert checks.boolean("key", np.True_) is True
    for value in (0, "true", None):
        assert "true or false" in refused(checks.boolean, value)


def test_choices_are_listed():
    assert checks.one_of("key", "a", ("a", "b")) == "a"
    assert "must be one of a, b" in refused(checks.one_of, "c", ("a", "b"))
    assert "must be one of a, b" in refused(checks.one_of, None, ("a", "b"))


@given(st.lists(st.floats(-1e9, 1e9), max_size=6))
def test_vectors_become_tuples_of_floats(values):
    for given_as in (values, tuple(values), np.array(values)):
        assert checks.vector("key", given_as, len(values)) == tuple(values)
        assert checks.vector("key", given_as, None) == tuple(values)


@pytest.mark.parametrize(
    "value", ["ab", b"ab", 5, None, [1], [1, 2, 3], [1, math.nan], [1, True], [1, "2"], {1, 2}, np.array(1.0)]
)
def test_what_is_no_pair_of_numbers_is_refused(value):
    assert "list of 2 finite numbers" in refused(checks.vector, value, 2)


@pytest.mark.parametrize("value", [[1, 1], [2, 1]])
def test_intervals_are_not_empty(value):
    assert "low < high" in refused(checks.interval, value)


def test_an_interval_is_a_pair():
    assert checks.interval("key", [1, 2]) == (1.0, 2.0)


def test_true_values_lie_between_their_bounds():
    checks.ordered_bounds((0, 0), (2, 2), (1, 1), "length/time")
    with pytest.raises(InvalidValue, match=r"upper=.*must exceed lower=\[0, 3\]"):
        checks.ordered_bounds((0, 3), (2, 2), (1, 1), "length/time")
    with pytest.raises(
        InvalidValue, match=r"true=\[1, 2\]: must lie inside the bounds \[length/time\]; widen"
    ):
        checks.ordered_bounds((0, 0), (2, 2), (1, 2), "length/time")
