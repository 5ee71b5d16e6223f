"""Episodes that end when enough is known."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.mission import run_replicate, summarise
from fieldrl.mission.record import combine
from tests.unit.mission.conftest import small

WIDE = {"b_x": 8.0, "b_y": 8.0}


@pytest.fixture(scope="module")
def recorded():
    stopping = small(steps=8, stop=WIDE)
    return stopping, run_replicate(stopping, 0, 0), run_replicate(small(steps=8), 0, 0)


def test_an_episode_ends_when_every_interval_is_narrower(mission):
    environment = mission(steps=20, stop={"b_x": 2.0}).environment()
    environment.reset(seed=0)
    terminated = False
    while not terminated:
        *_, terminated, truncated, _ = environment.step(0)
        assert not truncated
    assert 0 < len(environment.samples) < 20
    with pytest.raises(FieldrlError, match="enough is known"):
        environment.step(0)
    environment.reset()
    environment.step(0)


def test_the_first_episode_is_the_same_until_it_ends(recorded):
    _, stopped, whole = recorded
    n = int(stopped["samples_used"][0])
    assert n < 8
    for name in ("position", "value", "theta", "e_total", "reward"):
        np.testing.assert_array_equal(stopped[name][0, :n], whole[name][0, :n])


def test_the_estimate_and_its_errors_stay_and_nothing_else_is_told(recorded):
    _, record, _ = recorded
    n = int(record["samples_used"][0])
    assert np.isnan(record["value"][0, n:]).all()
    assert np.isnan(record["time"][0, n:]).all()
    assert (record["action"][0, n:] == -1).all()
    assert (record["reward"][0, n:] == 0).all()
    for name in ("theta", "e_total"):
        np.testing.assert_array_equal(record[name][0, -1], record[name][0, n - 1])


def test_record_and_summary_tell_the_samples_used_and_pool_only_these(recorded):
    mission, record, _ = recorded
    whole = combine([record], mission)
    assert np.isfinite(whole["pooled"]).all()
    assert np.isfinite(whole["field_course"]).all()
    used = summarise(whole)["samples_used"]
    assert used == record["samples_used"].values.tolist()
    taken = np.isfinite(record["value"]).sum(axis=1)
    np.testing.assert_array_equal(taken, used)


def test_nothing_of_it_is_in_a_record_without(recorded):
    assert "samples_used" not in recorded[2]


@pytest.mark.parametrize(
    ("stop", "said"), [({"b_z": 1.0}, r"stop\.b_z=1\.0: is no unknown"), ({"b_x": 0.0}, r"stop\.b_x=0")]
)
def test_unknowns_of_other_names_and_impossible_widths_are_refused(mission, stop, said):
    with pytest.raises(InvalidValue, match=said):
        mission(stop=stop)
