"""The localised source."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.pde.source import LocalisedSource

CENTRE = np.array([[80.0, 90.0]])


def test_the_rate_at_the_centre_is_the_strength():
    assert LocalisedSource(5.0, (80.0, 90.0), 10.0).rate(CENTRE, 3.0).tolist() == [5.0]


def test_one_width_away_one_part_in_e_is_left():
    source = LocalisedSource(5.0, (80.0, 90.0), 10.0)
    beside = np.array([[90.0, 90.0], [80.0, 80.0], [86.0, 98.0]])
    np.testing.assert_allclose(source.rate(beside, 0.0), 5.0 / math.e, rtol=1e-15)


def test_a_sink_takes_what_a_source_gives():
    positions = np.random.default_rng(1).uniform(50, 120, (6, 2))
    source, sink = (LocalisedSource(sign * 2.0, (80.0, 90.0), 15.0) for sign in (1, -1))
    np.testing.assert_array_equal(source.rate(positions, 1.0), -sink.rate(positions, 1.0))


@pytest.mark.parametrize(("time", "rate"), [(1.9, 0.0), (2.0, 5.0), (3.9, 5.0), (4.0, 0.0)])
def test_it_runs_from_opening_until_just_before_closing(time, rate):
    source = LocalisedSource(5.0, (80.0, 90.0), 10.0, opens=2.0, closes=4.0)
    assert source.rate(CENTRE, time)[0] == rate


def test_without_a_closing_time_it_never_stops():
    source = LocalisedSource(5.0, (80.0, 90.0), 10.0)
    assert source.rate(CENTRE, 1e9)[0] == 5.0
    assert source.constants.tolist() == [5.0, 80.0, 90.0, 10.0, 0.0, math.inf]


@pytest.mark.parametrize(
    ("key", "changed"),
    [
        ("strength", {"strength": math.nan}),
        ("centre", {"centre": (1.0, 2.0, 3.0)}),
        ("width", {"width": 0.0}),
        ("opens", {"opens": -1.0}),
        ("closes", {"opens": 3.0, "closes": 3.0}),
        ("closes", {"closes": math.inf}),
    ],
)
def test_a_bad_value_is_refused_by_its_name(key, changed):
    values = {"strength": 5.0, "centre": (80.0, 90.0), "width": 10.0} | changed
    with pytest.raises(InvalidValue) as error:
        LocalisedSource(**values)
    assert error.value.key == key
