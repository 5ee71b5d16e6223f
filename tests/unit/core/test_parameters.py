"""Parameters: bounds and what follows from them."""

import numpy as np

from fieldrl.core.parameters import Parameters
from fieldrl.pde.advection import Advection


def test_centre_and_half_width_follow_from_the_bounds():
    parameters = Parameters(("mu", "omega"), ("1", "rad/time"), (0.0, 0.1), (0.5, 1.3), (0.25, 0.6))
    assert len(parameters) == 2
    assert np.allclose(parameters.centre, [0.25, 0.7])
    assert np.allclose(parameters.half_width, [0.25, 0.6])


def test_the_true_values_may_be_unknown():
    nothing = Parameters(("b",), ("length/time",), (-1.0,), (1.0,))
    assert np.isnan(nothing.true).all()
    assert not nothing.truth_known


def test_one_true_value_may_be_unknown():
    model = Advection(true=[5.0, None])
    assert model.parameters.true[0] == 5.0
    assert np.isnan(model.parameters.true[1])
    assert not model.parameters.truth_known
