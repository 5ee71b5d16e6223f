"""A truth for every episode."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.pde.advection import Advection
from fieldrl.scenario.drawn import Drawn
from fieldrl.scenario.fixed import Fixed

WATER = Advection()


def truths(scenario: Drawn, count: int = 300) -> np.ndarray:
    rng = np.random.default_rng(0)
    return np.array([scenario.draw(WATER, rng).parameters.true for _ in range(count)])


def test_a_fixed_scenario_is_the_water_itself():
    assert Fixed().draw(WATER, np.random.default_rng(0)) is WATER


def test_truths_fill_the_bounds_of_the_estimate_or_a_box_within_them():
    wide, narrow = truths(Drawn()), truths(Drawn((1.0, -2.0), (2.0, -1.0)))
    assert wide.min(axis=0) == pytest.approx([-15, -15], abs=0.5)
    assert wide.max(axis=0) == pytest.approx([15, 15], abs=0.5)
    assert np.all((narrow >= [1, -2]) & (narrow <= [2, -1]))


def test_the_model_is_told_the_place_that_was_drawn_and_nothing_else_changes():
    drawn = Drawn(place=((10.0, 20.0), (30.0, 20.0))).draw(WATER, np.random.default_rng(0))
    assert 10 < drawn.initial.centre[0] < 30
    assert drawn.initial.centre[1] == 20
    assert (drawn.initial.scale, drawn.lower, drawn.domain) == (40.0, WATER.lower, WATER.domain)


def test_unknowns_by_name_are_drawn_too():
    about = {"true": 50.0, "lower": 0.0, "upper": 100.0}
    water = Advection(unknown={"centre_x": about, "amplitude": about | {"lower": 10.0}})
    parameters = Drawn().draw(water, np.random.default_rng(0)).parameters
    assert parameters.names == ("amplitude", "centre_x")
    assert 10 < parameters.true[0] < 100
    assert parameters.true[1] not in (50.0, parameters.true[0])


@pytest.mark.parametrize(
    ("scenario", "key"),
    [
        (Drawn(lower=(-20.0, 0.0)), "lower"),
        (Drawn(upper=(0.0,)), "upper"),
        (Drawn(lower=(5.0, 5.0), upper=(4.0, 6.0)), "upper"),
    ],
)
def test_a_box_that_does_not_fit_is_refused_by_name(scenario, key):
    with pytest.raises(InvalidValue) as error:
        scenario.draw(WATER, np.random.default_rng(0))
    assert error.value.key == key


@pytest.mark.parametrize("place", [((1.0, 2.0),), ((5.0, 5.0), (4.0, 6.0)), ((1.0,), (2.0,))])
def test_a_place_that_is_no_box_is_refused(place):
    with pytest.raises(InvalidValue, match="place"):
        Drawn(place=place)
