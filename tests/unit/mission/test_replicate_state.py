"""A replicate that is taken down and set up again goes on as if nothing had happened."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import xarray as xr

from fieldrl.agent.lawnmower import Lawnmower
from fieldrl.agent.random import Random
from fieldrl.agent.sarsa_lambda import SarsaLambda
from fieldrl.agent.schedules import Exponential
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.mission import run_replicate
from fieldrl.vehicle.sensor import Sensor
from fieldrl.vehicle.unicycle import Unicycle

AGENTS = {
    "sarsa": SarsaLambda(),
    "true online sarsa with schedules": SarsaLambda(
        traces="dutch", step_size=0.5, exploration_schedule=Exponential(rate=0.5)
    ),
    "random": Random(),
    "lawnmower": Lawnmower(),
}
ESTIMATORS = {
    "least squares": LeastSquares,
    "composite": Composite,
    "gaussian process": lambda: GaussianProcess(budget=4, initial=3),
    "gaussian process, sharing": lambda: GaussianProcess(budget=4, initial=3, share=True),
}


def states(mission) -> tuple[xr.Dataset, list[bytes]]:
    """The record of an uninterrupted replicate, and its state after each episode."""
    taken: list[bytes] = []
    record = run_replicate(
        mission, 3, 1, keep=lambda replicate: taken.append(pickle.dumps(replicate.state()))
    )
    return record, taken


@pytest.mark.parametrize("agent", AGENTS.values(), ids=AGENTS)
def test_every_agent_goes_on_bit_for_bit_after_any_episode(mission, agent):
    parts = {"agent": agent, "vehicle": Unicycle(sensor=Sensor(covariance=(1.0, 1.0, 0.01)))}
    expected, taken = states(mission(**parts))
    for state in taken:
        resumed = run_replicate(mission(**parts), 3, 1, state=pickle.loads(state))
        xr.testing.assert_identical(resumed, expected)


@pytest.mark.parametrize("estimator", ESTIMATORS.values(), ids=ESTIMATORS)
def test_every_estimator_goes_on_bit_for_bit_after_an_episode(mission, estimator):
    small = {"episodes": 2, "steps": 1, "evaluation_episodes": 0}
    expected, taken = states(mission(estimator=estimator(), **small))
    fresh = mission(estimator=estimator(), **small)
    xr.testing.assert_identical(run_replicate(fresh, 3, 1, state=pickle.loads(taken[0])), expected)


def test_a_state_is_taken_after_every_episode_and_at_the_end(mission):
    _, taken = states(mission())
    found = [pickle.loads(state) for state in taken]
    assert [(state["learned"], state["evaluated"]) for state in found] == [
        (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (3, 2),
    ]  # fmt: skip
    assert [len(state["pooled"]) for state in found] == [0, 0, 0, 0, 0, 2]


def test_a_finished_replicate_computes_nothing_again(mission):
    _, taken = states(mission())
    told, kept = [], []
    run_replicate(mission(), 3, 1, lambda *what: told.append(what[0]), kept.append, pickle.loads(taken[-1]))
    assert told == [2]
    assert kept == []


def test_chance_goes_on_where_it_was(mission):
    _, taken = states(mission())
    draws = [pickle.loads(state)["exploration"]["state"]["state"] for state in taken[:3]]
    assert len(set(draws)) == 3
    np.testing.assert_array_equal(pickle.loads(taken[0])["learning"]["values"]["value"][1:], np.nan)
