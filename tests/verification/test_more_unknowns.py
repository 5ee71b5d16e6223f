"""One to six unknowns: least squares finds them, and estimators for dear models say how near they came."""

import numpy as np
import pytest

from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection

BOUNDS = {
    "b_x": (-1.0, 3.0),
    "b_y": (-1.0, 3.0),
    "amplitude": (60.0, 140.0),
    "centre_x": (40.0, 60.0),
    "centre_y": (40.0, 60.0),
    "scale": (20.0, 40.0),
}
COUNTS = range(1, len(BOUNDS) + 1)


class Dear:
    """The same model without what makes it cheap: no derivatives, no compiled function."""

    def __init__(self, model):
        self.predict, self.parameters = model.predict, model.parameters


def problem(p, leave_one_out=True):
    """Thirty samples about the feature, sigma = 1, of a truth in the inner nine tenths of the bounds."""
    unknown = {name: {"lower": low, "upper": high} for name, (low, high) in list(BOUNDS.items())[:p]}
    model, rng = Advection(unknown=unknown), stream(p, "more unknowns")
    parameters = model.parameters
    truth = parameters.centre + parameters.half_width * rng.uniform(-0.9, 0.9, p)
    times = np.linspace(0.5, 10.0, 30)
    positions = 50.0 + times[:, None] + rng.uniform(-30.0, 30.0, (30, 2))
    values = model.predict(truth[None], positions, times)[0] + rng.standard_normal(30)
    return FitProblem(model, Samples.of(positions, times, values), leave_one_out=leave_one_out), truth


def standard_errors(of, theta):
    jacobian = of.model.jacobian(theta[None], of.samples.positions, of.samples.times)[0]
    return np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))


@pytest.mark.parametrize("p", COUNTS)
def test_least_squares_finds_them_within_their_standard_errors(p):
    of, truth = problem(p)
    fit = LeastSquares().fit(of)
    assert fit.converged.all()
    assert np.all(np.abs(fit.theta[0] - truth) < 4 * standard_errors(of, fit.theta[0]))


@pytest.mark.parametrize("p", COUNTS)
def test_composite_finds_the_same_minimum_within_its_budget(p):
    of, _ = problem(p, leave_one_out=False)
    least = LeastSquares().fit(of).loss[0]
    dear = FitProblem(Dear(of.model), of.samples, of.tikhonov, False)
    fit = Composite().fit(dear)
    assert fit.converged[0]
    assert fit.loss[0] < 1.01 * least
    assert fit.evaluations <= max(30 * p, 60)


@pytest.mark.parametrize("p", COUNTS)
def test_gaussian_processes_take_any_number_of_unknowns(p):
    of, _ = problem(p, leave_one_out=False)
    dear = FitProblem(Dear(of.model), of.samples, of.tikhonov, False)
    fit = GaussianProcess(budget=12, initial=8).fit(dear)
    least = LeastSquares().fit(of).loss[0]
    assert fit.loss[0] == pytest.approx(fit.course.loss.min())
    assert fit.loss[0] >= least * (1 - 1e-9)
    assert fit.loss[0] < 1.01 * least or not fit.converged[0]
