"""Tile coding: exactly one tile of each tiling, nothing clipped within the bounds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldrl.agent.tile_coding import OWN, TileCoding
from fieldrl.core.checks import InvalidValue

LOW, HIGH = np.array([0.0, -50.0, -np.pi / 4, 0.0]), np.array([200.0, 50.0, np.pi / 4, 20.0])


@st.composite
def codings(draw):
    variables = draw(st.lists(st.sampled_from(OWN), min_size=1, max_size=4, unique=True))
    tiles = draw(st.lists(st.integers(1, 9), min_size=len(variables), max_size=len(variables)))
    offsets = draw(st.sampled_from(["uniform", "asymmetric"]))
    return TileCoding(draw(st.integers(1, 16)), tiles, variables, offsets)


def observed(low, high):
    return st.lists(st.floats(low, high), min_size=4, max_size=4).map(
        lambda u: LOW + np.array(u) * (HIGH - LOW)
    )


@settings(deadline=None)
@given(codings(), observed(-2, 3))
def test_exactly_one_tile_of_each_tiling_is_active(coding, observation):
    active = coding.active(observation, coding.coder(LOW, HIGH))
    assert np.array_equal(active // np.prod(coding.tiles), np.arange(coding.tilings))


@settings(deadline=None)
@given(codings(), observed(0, 1))
def test_the_active_tile_holds_the_observation(coding, observation):
    """Each tile's sides, computed from the definition, enclose the value: nothing was clipped."""
    active = coding.active(observation, coding.coder(LOW, HIGH))
    indices = [OWN.index(name) for name in coding.variables]
    tiles = np.array(np.unravel_index(active % np.prod(coding.tiles), coding.tiles)).T
    offsets = coding.displacements()
    width = (HIGH - LOW)[indices] / (np.array(coding.tiles) - offsets.max(axis=0))
    lower = LOW[indices] + (tiles - offsets) * width
    slack = 1e-12 * (HIGH - LOW)[indices]
    assert np.all(lower <= observation[indices] + slack)
    assert np.all(observation[indices] <= lower + width + slack)


@settings(deadline=None)
@given(codings(), observed(-2, 3))
def test_a_value_outside_the_bounds_falls_into_the_edge_tile(coding, observation):
    coder = coding.coder(LOW, HIGH)
    at_the_edge = coding.active(np.clip(observation, LOW, HIGH), coder)
    assert np.array_equal(coding.active(observation, coder), at_the_edge)


def test_features_number_tilings_times_tiles():
    assert TileCoding().features == 8 * 8 * 8
    assert TileCoding(4, [3, 5], ["x", "time"]).features == 60
    assert TileCoding(tiles=6, variables=["x", "y", "heading"]).tiles == (6, 6, 6)


def test_every_feature_is_reached():
    coding = TileCoding(4, [3, 5])
    coder = coding.coder(LOW, HIGH)
    x, y = np.meshgrid(np.linspace(0, 200, 200), np.linspace(-50, 50, 200))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel(), 0 * x.ravel()], axis=1)
    reached = {int(feature) for point in points for feature in coding.active(point, coder)}
    assert reached == set(range(coding.features))


def test_asymmetric_offsets_are_the_odd_multiples_of_sutton_and_barto():
    expected = np.arange(8)[:, None] * [1, 3] % 8 / 8
    assert np.array_equal(TileCoding().displacements(), expected)


def test_uniform_offsets_follow_the_diagonal():
    expected = np.repeat(np.arange(4)[:, None] / 4, 2, axis=1)
    assert np.array_equal(TileCoding(4, offsets="uniform").displacements(), expected)


@settings(deadline=None)
@given(st.integers(1, 30), st.integers(1, 4), st.sampled_from(["uniform", "asymmetric"]))
def test_in_every_variable_the_tilings_are_evenly_displaced(tilings, d, offsets):
    coding = TileCoding(tilings, 1, OWN[:d], offsets)
    for column in coding.displacements().T:
        assert np.allclose(np.sort(column), np.arange(tilings) / tilings)


@pytest.mark.parametrize("offsets", ["uniform", "asymmetric"])
@pytest.mark.parametrize("variable", [0, 1])
def test_a_move_by_a_tilings_share_of_a_tile_changes_one_tiling(offsets, variable):
    coding = TileCoding(offsets=offsets)
    coder = coding.coder(LOW, HIGH)
    share = (HIGH - LOW)[variable] / (8 - 7 / 8) / 8
    for i in range(50):
        point = LOW.copy()
        point[variable] += (i + 0.5) * share
        moved = point.copy()
        moved[variable] += share
        assert np.sum(coding.active(point, coder) != coding.active(moved, coder)) == 1


@pytest.mark.parametrize(
    ("given", "key"),
    [
        ({"tilings": 0}, "tilings"),
        ({"tilings": 2.5}, "tilings"),
        ({"tiles": 0}, "tiles"),
        ({"tiles": [8]}, "tiles"),
        ({"tiles": [8, -1]}, "tiles"),
        ({"tiles": "8x8"}, "tiles"),
        ({"tiles": None}, "tiles"),
        ({"tiles": [100_000, 100_000]}, "tiles"),
        ({"variables": []}, "variables"),
        ({"variables": ["x", "x"]}, "variables"),
        ({"variables": ["x", "depth"]}, "variables"),
        ({"variables": "x"}, "variables"),
        ({"variables": None}, "variables"),
        ({"offsets": "random"}, "offsets"),
    ],
)
def test_bad_values_are_refused_by_name(given, key):
    with pytest.raises(InvalidValue) as error:
        TileCoding(**given)
    assert error.value.key == key


def test_a_tiled_variable_without_a_range_is_refused():
    high = HIGH.copy()
    high[1] = LOW[1]
    with pytest.raises(InvalidValue, match="variables"):
        TileCoding().coder(LOW, high)


def test_an_observation_that_is_not_a_number_stays_within_the_table():
    coding = TileCoding()
    active = coding.active(np.full(4, np.nan), coding.coder(LOW, HIGH))
    assert np.array_equal(active, 64 * np.arange(8))
