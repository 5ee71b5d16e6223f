"""A particle in the flow, against SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fieldrl.pde.flow import DoubleGyre, UniformFlow
from fieldrl.pde.tracer import carried


def test_a_uniform_flow_carries_a_particle_straight():
    assert carried(UniformFlow(), (3.0, -2.0), (50.0, 40.0), 20.0) == pytest.approx((110.0, 0.0))


def test_the_gyres_carry_a_particle_as_scipy_says():
    flow, theta = DoubleGyre(), np.array([0.25, np.pi / 5])
    exact = solve_ivp(
        lambda t, x: flow.velocity(theta, x[None], t)[0], (0, 10), (60.0, 40.0), rtol=1e-10, atol=1e-10
    )
    assert carried(flow, theta, (60.0, 40.0), 10.0) == pytest.approx(exact.y[:, -1], abs=1e-3)


def test_at_time_zero_it_is_where_it_was():
    place = np.array([60.0, 40.0])
    moved = carried(UniformFlow(), (3.0, -2.0), place, 0.0)
    assert moved.tolist() == [60.0, 40.0]
    assert moved is not place
