"""What the figures are drawn from, on made-up data."""

import numpy as np
import pytest

from fieldrl.agent.tile_coding import TileCoding
from fieldrl.pde.flow import DoubleGyre
from fieldrl.vehicle.unicycle import Unicycle
from pipelines import artefacts
from pipelines.experiments import Settings
from pipelines.paper import figure_2, gyres, landscape, table_1, variations


def test_the_active_tile_of_every_tiling_holds_the_state():
    for coding in (TileCoding(tilings=3, tiles=(2, 2)), TileCoding()):
        for tiling in figure_2.tilings(coding):
            (i, j), (x, y) = tiling.active, figure_2.STATE[:2]
            assert tiling.x[i] <= x < tiling.x[i + 1]
            assert tiling.y[j] <= y < tiling.y[j + 1]


def test_the_feature_vector_has_one_active_feature_for_each_tiling():
    features = figure_2.feature_vector(TileCoding(tilings=3, tiles=(2, 2)))
    assert features.size == 12
    np.testing.assert_array_equal(features.reshape(3, 4).sum(axis=1), 1)


def test_table_1_has_the_seven_actions_and_where_they_end():
    vehicle = Unicycle()
    assert [row[:2] for row in table_1.rows(vehicle)][:4] == [
        ["v_max", "0"], ["v_max / 2", "0"], ["v_max", "-phi"], ["v_max", "+phi"],
    ]  # fmt: skip
    np.testing.assert_allclose(table_1.path(vehicle, 0)[-1], [10, 0])
    assert table_1.path(vehicle, 3)[-1, 1] > 0 > table_1.path(vehicle, 2)[-1, 1]
    np.testing.assert_allclose(table_1.path(vehicle, 6)[-1], [0, 0])


@pytest.mark.parametrize("time", [0.0, 1.3, 2.5, 5.0, 7.5])
def test_no_water_crosses_the_separation_line_of_a_moment(time):
    theta = (0.25, np.pi / 5)
    x = float(gyres.separation(theta, time, 100.0))
    places = np.column_stack([np.full(5, x), np.linspace(5, 95, 5)])
    np.testing.assert_allclose(DoubleGyre().velocity(theta, places, time)[:, 0], 0, atol=1e-10)


def test_minima_of_a_map_are_found_inside_and_on_its_edge():
    x, y = np.meshgrid(np.linspace(0, 1, 11), np.linspace(0, 1, 11), indexing="ij")
    bowl = np.minimum((x - 0.5) ** 2 + (y - 0.3) ** 2, 0.02 + (x - 1) ** 2 + (y - 1) ** 2)
    assert landscape.grid_minima(bowl) == [(5, 3), (10, 10)]


def test_the_usual_values_of_all_parameters_are_one_run():
    settings = Settings()
    usual = {
        variations.wanted("global", name, parameter.usual)
        for name, parameter in variations.PARAMETERS.items()
    }
    assert len(usual) == 1
    assert len(set(variations.plan(settings).values())) == 14


def test_the_small_scale_keeps_the_usual_value():
    for name, parameter in variations.PARAMETERS.items():
        values = variations.values(name, Settings(scale="small"))
        assert parameter.usual in values
        assert len(values) == 2


def test_numbers_become_json_with_six_digits_and_null_for_what_is_not_finite():
    found = artefacts.plain({"a": np.array([1 / 3, np.nan]), "b": (np.int64(2), True, "text")})
    assert found == {"a": [0.333333, None], "b": [2, True, "text"]}
