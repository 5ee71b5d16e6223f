"""The errors that a run reports, against what statistics expects of them."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.agent.random import Random
from fieldrl.agent.sarsa_lambda import SarsaLambda
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.mission import Mission, run_replicate
from fieldrl.pde.advection import Advection
from fieldrl.reward.total_error import TotalError
from fieldrl.vehicle.sensor import Sensor
from fieldrl.vehicle.unicycle import Unicycle


def mission(episodes: int, noise: float = 1.0, agent=None, **estimator) -> Mission:
    vehicle = Unicycle(sensor=Sensor(noise=noise))
    learner = SarsaLambda() if agent is None else agent
    return Mission(Advection(), vehicle, learner, LeastSquares(**estimator), TotalError(), episodes, 20)


@pytest.mark.slow
@pytest.mark.parametrize("replicate", [0, 1])
def test_after_learning_the_mean_total_error_is_about_twice_the_noise_s_variance(replicate):
    record = run_replicate(mission(400), 0, replicate)
    assert 1.6 < record["e_total"].values[-100:, -1].mean() < 2.4


@pytest.mark.parametrize("noise", [0.5, 3.0])
def test_the_total_error_scales_with_the_variance_of_the_noise(noise):
    record = run_replicate(mission(60, noise, Random()), 0, 0)
    assert np.median(record["e_total"].values[:, -1]) / noise**2 == pytest.approx(2.0, abs=0.4)


def test_without_noise_the_flow_is_found_and_the_errors_all_but_vanish():
    record = run_replicate(mission(5, 0.0, Random(), tikhonov=1e-9), 0, 0)
    np.testing.assert_allclose(record["theta"].values[:, -1], 5.0, atol=1e-3)
    assert record["e_total"].values[:, -1].max() < 1e-4


def test_a_local_optimiser_leaves_larger_errors_than_the_global_one():
    local, best = (
        run_replicate(mission(60, agent=Random(), starts=starts), 0, 0)["e_total"].values[:, -1].mean()
        for starts in (1, 4)
    )
    assert local > 1.5 * best
