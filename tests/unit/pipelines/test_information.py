"""What samples are worth: the true field without noise, and the Cramer-Rao bound."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from fieldrl.mission import run_replicate
from fieldrl.mission.record import combine
from pipelines.experiments import Found, Wanted
from pipelines.paper import information

SMALL = ("replicates=2", "episodes=3", "steps=6", "evaluation_episodes=0")


def found(*overrides: str, experiment: str = "advection") -> Found:
    run = Found(Wanted(experiment, (*SMALL, *overrides)), "key", xr.Dataset(), 0.0)
    record = combine([run_replicate(run.mission, 0, number) for number in range(2)], run.mission)
    return replace(run, record=record)


@pytest.fixture(scope="module")
def random() -> Found:
    return found("agent=random")


def test_the_field_along_a_path_is_what_was_measured_without_noise(random):
    field = information.field_along(random)
    noise = random.record["value"].transpose("replicate", "episode", "step").values - field
    assert field.shape == (2, 3, 6)
    assert 0.5 < noise.std() < 1.5
    silent = found("agent=random", "vehicle.sensor.noise=0")
    np.testing.assert_allclose(information.field_along(silent), silent.record["value"].values, atol=1e-9)


def test_the_bound_is_that_of_the_fisher_information_and_the_bounds(random):
    record, water = random.record, random.mission.water
    places, times = record["position"].values[1, 2], record["time"].values[1, 2]
    jacobian = 15.0 * water.jacobian(np.array([[5.0, 5.0]]), places, times)[0]
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(2))
    expected = np.sqrt(np.trace(covariance) / 2)
    assert information.bounds(random)[1, 2] == pytest.approx(expected)


def test_a_vehicle_that_drifts_with_the_feature_learns_one_direction_at_most():
    np.testing.assert_allclose(information.bounds(found("agent=drift")), np.sqrt(0.5), rtol=1e-3)


def test_estimates_scatter_as_the_bound_says():
    many = found("agent=random", "episodes=150", "steps=12")
    ratio = information.errors(many.record, many.mission) / information.bounds(many)
    assert 0.8 < np.sqrt(np.median(ratio**2) / 0.69) < 1.25  # 0.69: median of half a chi-square of two
