"""Missions with drawn truths, judged; small ones."""

from __future__ import annotations

import numpy as np
import pytest

from pipelines.calibration import blocks, cases, selection
from pipelines.calibration.missions import SIZES, world
from pipelines.experiments import Settings


@pytest.fixture(scope="module")
def random_world():
    return world("advection", "random")


def test_a_mission_is_its_number_and_its_agent(random_world):
    one, again, other = (random_world.drawn(number) for number in (0, 0, 1))
    assert np.array_equal(one.positions, again.positions)
    assert np.array_equal(one.noise, again.noise)
    assert not np.array_equal(one.truth, other.truth)
    lawnmower = world("advection", "lawnmower").drawn(0)
    assert not np.array_equal(one.truth, lawnmower.truth)
    assert not np.array_equal(one.noise, lawnmower.noise)


def test_values_without_noise_are_the_true_field(random_world):
    one = random_world.drawn(3)
    field = one.water.truth().predict(one.truth[None], one.positions, one.times)[0]
    assert np.allclose(one.clean, field, rtol=1e-12)
    assert np.all(np.abs(one.samples(20).values - field) < 6.0)


def test_a_wrong_model_is_called_wrong_and_its_misfit_measured(random_world):
    last = cases.judge(random_world, 0)[-1]
    size, p = last["wrong outlier"]
    assert 0.5 < size <= 6.0 / np.sqrt(SIZES[-1])
    assert p < 0.01
    assert last["p"] > 0.05


def test_choosing_the_best_judges_three_estimates(random_world, monkeypatch):
    monkeypatch.setattr(selection, "EPISODES", 3)
    (row,) = selection.judge(random_world, 0)
    single = {f"{name}, {how}" for name in ("best", "first") for how in selection.HOW}
    assert row.keys() == {"run"} | single | {f"pooled, {how}" for how in selection.HOW[:2]}


def test_what_is_finished_is_not_judged_again(tmp_path, monkeypatch):
    monkeypatch.setattr(blocks, "COUNTS", {"small": {"advection": 1}})
    monkeypatch.setattr(blocks, "RUNS", {"small": 0})
    monkeypatch.setattr(blocks, "NEEDED", {"small": 1})
    settings = Settings(scale="small", output_dir=str(tmp_path), jobs=1)
    found = blocks.find(settings)
    assert [row["n"] for row in found["advection", "learned"]] == list(SIZES)
    assert len(found["advection", "needed learned"][0]["widest"]) == SIZES[-1]
    monkeypatch.setattr(blocks, "judge", None)
    monkeypatch.setattr(blocks, "needed", None)
    assert blocks.find(settings) == found
