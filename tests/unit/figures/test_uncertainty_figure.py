"""The pictures of what is known of an estimate."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.figures import uncertainty
from fieldrl.mission import run_replicate
from fieldrl.mission.record import combine
from tests.unit.mission.conftest import small


@pytest.fixture(scope="module")
def record():
    mission = small(episodes=2, steps=6, stop={"b_x": 0.5, "b_y": 0.5})
    return combine([run_replicate(mission, 0, 0)], mission)


def test_regions_have_a_map_within_the_bounds_and_a_closer_one_with_the_truth(record):
    whole, closer = uncertainty.regions_figure(record).axes
    assert whole.get_xlim() == (-15.0, 15.0)
    low, high = closer.get_xlim()
    first = record["best_region_first"].values
    assert (low, high) == (np.nanmin(first), np.nanmax(first))
    crosses = [line for line in whole.lines if line.get_marker() == "x"]
    assert [one.get_xydata().tolist() for one in crosses] == [[[5.0, 5.0]]]
    assert "50 and 95 %" in whole.figure.legends[0].get_texts()[0].get_text()


def test_a_truth_that_nobody_knows_is_not_in_the_legend(record):
    hidden = record.assign(true=record["true"] * np.nan)
    texts = [text.get_text() for text in uncertainty.regions_figure(hidden).legends[0].get_texts()]
    assert "truth" not in texts


def test_an_estimate_from_a_file_has_regions_of_all_samples_alone(record):
    found = record.assign(true=record["true"] * np.nan).assign_attrs(kind="estimate")
    (text,) = uncertainty.regions_figure(found).legends[0].get_texts()
    assert text.get_text() == "all samples: 50 and 95 %"


def test_the_map_of_the_field_begins_at_zero(record):
    axes = uncertainty.field_std_figure(record).axes[0]
    low, high = axes.images[0].get_clim()
    assert low == 0.0
    assert high == pytest.approx(float(record["field_std"].max()))


def test_samples_used_are_drawn_by_episode(record):
    axes = uncertainty.samples_used_figure(record).axes[0]
    median = axes.lines[-1].get_ydata()
    np.testing.assert_array_equal(median, record["samples_used"].isel(replicate=0))
