"""The initial feature, Eq. (26)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldrl.core.checks import InvalidValue
from fieldrl.pde.initial import InitialFeature

coordinates = st.floats(-200, 200)


def test_the_centre_has_the_amplitude():
    feature = InitialFeature(amplitude=-7.0, centre=(3.0, 4.0), scale=2.0, exponent=1.5)
    assert feature.value(np.array([[3.0, 4.0]])).tolist() == [-7.0]


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 4.0])
def test_one_scale_along_an_axis_leaves_one_part_in_e(exponent):
    feature = InitialFeature(100.0, (50.0, 60.0), 40.0, exponent)
    beside = np.array([[90.0, 60.0], [10.0, 60.0], [50.0, 100.0], [50.0, 20.0]])
    np.testing.assert_allclose(feature.value(beside), 100.0 / math.e, rtol=1e-15)


def test_exponent_one_decays_with_the_sum_of_distances():
    feature = InitialFeature(1.0, (0.0, 0.0), 2.0, 1.0)
    assert feature.value(np.array([[3.0, -5.0]]))[0] == pytest.approx(math.exp(-4.0), rel=1e-15)


@given(coordinates, coordinates, st.floats(1, 6), st.floats(5, 100))
def test_the_feature_mirrors_at_its_centre_and_never_exceeds_it(x, y, exponent, scale):
    feature = InitialFeature(100.0, (50.0, 50.0), scale, exponent)
    value, mirrored = feature.value(np.array([[50 + x, 50 + y], [50 - x, 50 - y]]))
    assert 0.0 <= value <= 100.0
    assert mirrored == pytest.approx(value, rel=1e-9)


def test_a_batch_of_positions_keeps_its_order():
    feature = InitialFeature()
    positions = np.random.default_rng(0).uniform(0, 200, (9, 2))
    alone = [feature.value(position[None])[0] for position in positions]
    assert feature.value(positions).tolist() == alone


def test_constants_hold_every_field_in_order():
    feature = InitialFeature(1.0, (2.0, 3.0), 4.0, 5.0)
    assert feature.constants.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("amplitude", math.nan),
        ("centre", (1.0,)),
        ("centre", "ab"),
        ("scale", 0.0),
        ("scale", -1.0),
        ("exponent", 0.99),
        ("exponent", math.inf),
    ],
)
def test_a_bad_value_is_refused_by_its_name(key, value):
    with pytest.raises(InvalidValue) as error:
        InitialFeature(**{key: value})
    assert error.value.key == key
