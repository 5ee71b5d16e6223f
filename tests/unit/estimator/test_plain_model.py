"""A model of somebody else: nothing but parameters and predictions."""

from __future__ import annotations

import numpy as np
import pytest

import fieldrl
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem


class Decay:
    """A patch that decays where it is: amplitude exp(-rate t - |x|^2 / 50^2)."""

    parameters = Parameters(("amplitude", "rate"), ("field unit", "1/time"), (50.0, 0.0), (150.0, 0.5))

    def predict(self, theta, positions, times):
        shape = np.exp(-np.sum(positions**2, axis=1) / 50.0**2)
        return theta[:, :1] * np.exp(-theta[:, 1:] * times) * shape


@pytest.mark.parametrize("estimator", [LeastSquares(), Composite(), GaussianProcess()])
def test_a_plain_class_is_fitted_by_every_estimator(estimator):
    places, times, theta = np.random.default_rng(0).uniform(0, 40, (8, 2)), np.arange(8.0), [[120.0, 0.2]]
    samples = Samples.of(places, times, Decay().predict(np.array(theta), places, times)[0])
    found = estimator.fit(FitProblem(Decay(), samples, estimator.tikhonov, leave_one_out=False))
    tolerance = 0.2 if isinstance(estimator, GaussianProcess) else 0.02
    np.testing.assert_allclose(found.theta[0], theta[0], rtol=tolerance)


def test_samples_alone_and_a_plain_class_give_an_estimate():
    rng = np.random.default_rng(1)
    places, times = rng.uniform(0, 40, (12, 2)), np.arange(12.0)
    values = Decay().predict(np.array([[120.0, 0.2]]), places, times)[0] + rng.normal(0, 0.5, 12)
    found = fieldrl.estimate(Samples.of(places, times, values), Decay())
    assert found.theta == pytest.approx([120.0, 0.2], rel=0.1)
