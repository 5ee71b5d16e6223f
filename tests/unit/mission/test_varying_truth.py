"""Missions whose truth is another in every episode."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from fieldrl.agent.random import Random
from fieldrl.core.checks import InvalidValue
from fieldrl.mission import combine, run_replicate, summarise
from fieldrl.mission.learning import Replicate
from fieldrl.observation.informed import Informed
from fieldrl.scenario.drawn import Drawn

PLACE = ((40.0, 40.0), (60.0, 60.0))


@pytest.fixture
def search(mission):
    return mission(scenario=Drawn(place=PLACE), observation=Informed(), agent=Random())


def test_the_record_keeps_the_truth_of_every_episode(search):
    record = run_replicate(search, seed=3, number=0)
    assert len(np.unique(record["truth"])) == 6
    assert len(np.unique(record["evaluation_truth"])) == 4
    assert np.all((record["place"] >= 40) & (record["place"] <= 60))
    assert np.isnan(record["pooled"]).all()


def test_every_episode_samples_the_field_of_its_own_truth(search):
    record, model = run_replicate(search, seed=3, number=0), search.water
    for episode in range(3):
        one = record.isel(episode=episode)
        water = search.scenario.draw(model, Replicate(search, 3, 0)._chance(episode))
        assert water.parameters.true == tuple(one["truth"].values)
        clean = water.predict(one["truth"].values[None], one["position"].values, one["time"].values)[0]
        assert np.abs(one["value"].values - clean).max() < 5.0


def test_the_same_seed_draws_the_same_truths_whatever_the_agent_does(mission):
    parts = {"scenario": Drawn(place=PLACE), "observation": Informed()}
    one = run_replicate(mission(**parts), seed=3, number=0)
    other = run_replicate(mission(**parts, agent=Random()), seed=3, number=0)
    assert np.array_equal(one["truth"], other["truth"])
    assert not np.array_equal(one["position"], other["position"])


def test_the_summary_compares_the_best_episode_with_its_own_truth(search):
    record = combine([run_replicate(search, 3, number) for number in range(2)], search)
    summary, best = summarise(record), int(record["best_episode"][0])
    true = record["truth"].values[0, best]
    estimate = record["theta"].values[0, best, -1]
    assert summary["parameters"]["b_x"]["true"] == true[0]
    assert summary["theta_error"] == pytest.approx(np.linalg.norm(estimate - true))
    assert record["field_true"].dims == ("replicate", "x", "y")


def test_gymnasium_s_checker_finds_nothing_to_say(search):
    environment = search.environment()
    check_env(environment, skip_render_check=True)
    environment.reset(seed=5)
    first = environment.theta
    environment.reset()
    assert not np.array_equal(environment.theta, first)
    environment.reset(seed=5)
    assert np.array_equal(environment.theta, first)


def test_a_box_outside_the_bounds_is_refused_as_the_scenario_s(mission):
    with pytest.raises(InvalidValue) as error:
        mission(scenario=Drawn(lower=(-20.0, 0.0)))
    assert error.value.key == "scenario.lower"


def test_variables_that_are_not_observed_are_refused(mission):
    from fieldrl.agent.sarsa_lambda import SarsaLambda
    from fieldrl.agent.tile_coding import TileCoding

    learner = SarsaLambda(tile_coding=TileCoding(8, 4, ["plume_distance", "estimate_2"]))
    with pytest.raises(InvalidValue, match="observation=informed") as error:
        mission(agent=learner)
    assert error.value.key == "agent.tile_coding.variables"
    assert mission(agent=learner, observation=Informed()).steps == 4
    with pytest.raises(InvalidValue, match="estimate_3"):
        mission(agent=SarsaLambda(tile_coding=TileCoding(8, 4, ["estimate_3"])), observation=Informed())
