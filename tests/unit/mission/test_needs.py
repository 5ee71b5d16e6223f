"""What a run takes is estimated from settings, without making anything large."""

from __future__ import annotations

import time

import pytest

from fieldrl.agent.random import Random
from fieldrl.agent.sarsa_lambda import SarsaLambda
from fieldrl.agent.tile_coding import TileCoding
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.mission.needs import BUDGET, needs
from fieldrl.pde.advection import Advection
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.vehicle.unicycle import Unicycle

SMALL = dict(zip(BUDGET, (1, 10, 10, 1), strict=True))


def total(processes=1, budget=None, **changed):
    parts = {"water": Advection(), "vehicle": Unicycle(), "agent": SarsaLambda(), "estimator": LeastSquares()}
    costs = needs(**parts | changed, budget=SMALL | (budget or {}), processes=processes).values()
    return sum(cost.memory for cost in costs), sum(cost.seconds for cost in costs)


MORE = [
    {"agent": SarsaLambda(tile_coding=TileCoding(tiles=(300, 300)))},
    {"estimator": LeastSquares(grid=300)},
    {"estimator": LeastSquares(starts=10**6)},
    {"estimator": Composite(neighbours=10**4, memory=10**4, budget=10**4)},
    {"estimator": GaussianProcess(budget=1000)},
    {"vehicle": Unicycle(substeps=10**6)},
    {"budget": {"episodes": 10**6}},
    {"budget": {"steps": 1000}},
    {"budget": {"replicates": 1000}},
    {"budget": {"evaluation_episodes": 10**5}},
]


@pytest.mark.parametrize("more", MORE, ids=str)
def test_more_takes_more(more):
    before, after = total(), total(**more)
    assert after[0] >= before[0]
    assert after[1] >= before[1]
    assert after[0] > 2 * before[0] or after[1] > 2 * before[1]


def test_a_finer_grid_takes_more_memory_and_time():
    coarse, fine = (total(water=AdvectionDiffusion(cells=cells)) for cells in ((50, 25), (200, 100)))
    assert fine[0] > 8 * coarse[0]
    assert fine[1] > 8 * coarse[1]


def test_absurd_budgets_are_estimated_at_once():
    started = time.perf_counter()
    memory, _ = total(budget={"episodes": 10**12, "replicates": 10**12})
    assert memory > 1e20
    assert time.perf_counter() - started < 0.5


def test_memory_grows_with_processes_and_time_shrinks():
    one, two = (total(processes=processes, budget={"replicates": 4}) for processes in (1, 2))
    assert two[0] > one[0]
    assert two[1] == pytest.approx(one[1] / 2)


def test_parts_that_tell_nothing_count_as_nothing():
    assert total(agent=Random()) < total()
