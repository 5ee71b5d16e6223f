"""Robust losses, unlike noise and detection limits, on a model of two unknowns."""

import numpy as np
import pytest

import fieldrl
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.loss.huber import Huber
from fieldrl.loss.squared import Squared
from fieldrl.loss.student_t import StudentT
from fieldrl.pde.advection import Advection


class Line:
    """Value a + b x."""

    parameters = Parameters(("a", "b"), ("1", "1"), (-10.0, -10.0), (10.0, 10.0))

    def predict(self, theta, positions, times):
        return theta[:, :1] + theta[:, 1:] * positions[:, 0]

    def jacobian(self, theta, positions, times):
        one = np.stack([np.ones(len(times)), positions[:, 0]], axis=1)
        return np.repeat(one[None], len(theta), axis=0)


def table(theta, rng, std=0.1, count=20):
    x = rng.uniform(-1, 1, count)
    noise = std * rng.normal(size=count)
    return {"time": np.arange(count), "x": x, "y": 0 * x, "value": theta[0] + theta[1] * x + noise}


FIT = LeastSquares(tikhonov=1e-9, starts=1)


@pytest.mark.parametrize("loss", [Huber(), StudentT()], ids=["huber", "student_t"])
def test_outliers_do_not_move_a_robust_estimate_and_its_interval_covers(loss):
    covered, rng = [], stream(0, "outliers of a test")
    for _ in range(25):
        theta = rng.uniform(-5, 5, 2)
        samples = table(theta, rng)
        samples["value"][[3, 11]] += (30.0, 8.0)
        found = fieldrl.estimate(samples, Line(), FIT, loss)
        assert np.abs(found.theta - theta).max() < 0.3
        assert {3, 11} <= set(found.outliers)
        assert 0.04 < found.noise < 0.2
        covered += [
            low < true < high for true, (low, high) in zip(theta, found.intervals.values(), strict=True)
        ]
    assert np.mean(covered) > 0.85


def test_least_squares_is_moved_and_says_so():
    samples = table((1.0, 2.0), stream(0, "outliers of a test"))
    samples["value"][3] += 30.0
    found = fieldrl.estimate(samples, Line(), FIT)
    assert np.abs(found.theta - (1.0, 2.0)).max() > 0.5
    assert "Sample 4 is far off" in found.verdict


def test_values_of_more_noise_weigh_less():
    rng = stream(1, "noise of a test")
    exact, rough = table((1.0, 2.0), rng, 0.01), table((1.0, 2.0), rng, 3.0)
    both = {key: np.concatenate([exact[key], rough[key]]) for key in exact}
    found = fieldrl.estimate(both | {"std": np.repeat([0.01, 3.0], 20)}, Line(), FIT)
    assert np.abs(found.theta - (1.0, 2.0)).max() < 0.02
    assert found.noise_stated
    low, high = found.intervals["b"]
    assert low < 2.0 < high < low + 0.05


def test_a_detection_limit_counts_only_where_the_prediction_lies_above_it():
    samples = table((0.0, 4.0), stream(2, "limits of a test"), 0.05)
    found = fieldrl.estimate(samples, Line(), FIT, detection_limit=1.0)
    assert np.abs(found.theta - (0.0, 4.0)).max() < 0.2
    below = samples["value"] <= 1.0
    assert np.all(found.fit.residuals[0][np.argsort(samples["time"])][below] >= 0.0)


def test_one_stated_noise_for_all_leaves_least_squares_as_it_was():
    samples = table((1.0, 2.0), stream(3, "noise of a test"))
    plain, stated = (fieldrl.estimate(samples, Line(), FIT, Squared(), **more) for more in ({}, {"std": 0.1}))
    assert np.array_equal(plain.theta, stated.theta)


@pytest.mark.parametrize("loss", [Huber(), StudentT()], ids=["huber", "student_t"])
def test_the_narrow_minimum_of_a_robust_loss_is_found_where_the_model_is_compiled(loss):
    rng = stream(4, "outliers of a test")
    theta, water, hits = np.array([4.2, 3.1]), Advection(), 0
    for _ in range(6):
        times = np.sort(rng.uniform(0.5, 12, 25))
        positions = 50 + times[:, None] * theta + rng.normal(0, 25, (25, 2))
        values = water.predict(theta[None], positions, times)[0] + rng.normal(0, 1, 25)
        values[12] += 40.0
        found = fieldrl.estimate(Samples.of(positions, times, values), water, LeastSquares(), loss)
        assert 12 in found.outliers
        assert 0.4 < found.noise < 2.0
        hits += bool(np.all(np.abs(found.theta - theta) < 4 * np.array(list(found.std.values()))))
    assert hits == 6
