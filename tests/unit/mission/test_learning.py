"""The learning loop: streams, evaluation, pooling, reports."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fieldrl.agent.lawnmower import Lawnmower
from fieldrl.agent.random import Random
from fieldrl.mission import run_replicate
from fieldrl.vehicle.sensor import Sensor
from fieldrl.vehicle.unicycle import Unicycle


def test_the_same_seed_gives_the_same_record_bit_for_bit(mission):
    xr.testing.assert_identical(run_replicate(mission(), 3, 0), run_replicate(mission(), 3, 0))


def test_a_mission_used_before_gives_the_same_record(mission):
    used = mission()
    first = run_replicate(used, 3, 0)
    run_replicate(used, 8, 1)
    xr.testing.assert_identical(run_replicate(used, 3, 0), first)


def test_replicates_and_seeds_have_chances_of_their_own(mission):
    records = [run_replicate(mission(), seed, number) for seed, number in ((0, 0), (0, 1), (1, 0))]
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert not np.any(records[one]["value"].values == records[other]["value"].values)


@pytest.mark.parametrize("evaluation_episodes", [0, 1, 5])
def test_the_number_of_evaluation_episodes_does_not_change_what_is_learned(mission, evaluation_episodes):
    usual = run_replicate(mission(), 0, 0)
    other = run_replicate(mission(evaluation_episodes=evaluation_episodes), 0, 0)
    assert other.sizes["evaluation_episode"] == evaluation_episodes
    for name in ("position", "value", "reward", "theta", "return", "pooled"):
        np.testing.assert_array_equal(other[name], usual[name])


def test_more_episodes_begin_as_fewer_do(mission):
    few, more = (run_replicate(mission(episodes=n), 0, 0) for n in (2, 5))
    np.testing.assert_array_equal(more["position"][:2], few["position"])
    np.testing.assert_array_equal(more["value"][:2], few["value"])


def test_evaluation_episodes_follow_one_frozen_policy(mission):
    quiet = Unicycle(sensor=Sensor(noise=0.0))
    record = run_replicate(mission(episodes=30, evaluation_episodes=2, vehicle=quiet), 0, 0)
    untouched = run_replicate(mission(episodes=30, evaluation_episodes=4, vehicle=quiet), 0, 0)
    np.testing.assert_array_equal(
        untouched["evaluation_action"][:2].values, record["evaluation_action"].values
    )


@pytest.mark.parametrize("agent", [Random(), Lawnmower()], ids=["random", "lawnmower"])
def test_agents_that_do_not_learn_run_too(mission, agent):
    record = run_replicate(mission(agent=agent, steps=6), 0, 0)
    assert np.all(np.isfinite(record["e_total"]))
    assert record["action"].values.min() >= 0
    assert record["action"].values.max() <= 6


def test_the_lawnmower_repeats_itself_and_chance_does_not(mission):
    mower, chance = (run_replicate(mission(agent=agent, steps=8), 0, 0) for agent in (Lawnmower(), Random()))
    assert np.all(mower["action"].values == mower["action"].values[0])
    assert not np.all(chance["action"].values == chance["action"].values[0])


def test_a_report_is_told_each_episode_with_its_return_and_final_error(mission):
    told = []
    record = run_replicate(mission(), 0, 0, lambda *what: told.append(what))
    assert [episode for episode, _, _ in told] == [0, 1, 2]
    assert [value for _, value, _ in told] == record["return"].values.tolist()
    assert [error for _, _, error in told] == record["e_total"].values[:, -1].tolist()


def test_an_episode_of_one_sample_is_possible(mission):
    record = run_replicate(mission(steps=1), 0, 0)
    assert record["theta"].shape == (3, 1, 2)
    assert np.all(np.isfinite(record["e_total"]))


def test_the_pooled_estimate_is_better_than_a_typical_episode_s(mission):
    record = run_replicate(mission(episodes=40, steps=20, evaluation_episodes=0), 1, 0)
    alone = np.linalg.norm(record["theta"].values[:, -1] - 5.0, axis=1)
    assert np.linalg.norm(record["pooled"].values - 5.0) < 0.5 * np.median(alone)


def test_a_measured_position_differs_from_the_true_one_by_the_sensor_s_noise(mission):
    vague = Unicycle(sensor=Sensor(covariance=(4.0, 4.0, 0.0)))
    record = run_replicate(mission(vehicle=vague, episodes=20, steps=10), 0, 0)
    offset = (record["measured_position"] - record["position"]).values
    assert offset.std() == pytest.approx(2.0, rel=0.1)
    exact = run_replicate(mission(), 0, 0)
    np.testing.assert_array_equal(exact["measured_position"], exact["position"])
