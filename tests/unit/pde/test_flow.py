import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from fieldrl.core.checks import InvalidValue
from fieldrl.core.compiled import call_flow
from fieldrl.pde.flow import DoubleGyre, Separable, UniformFlow

CASES = [(UniformFlow(), (5.0, -3.0)), (DoubleGyre(), (0.25, np.pi / 5)), (DoubleGyre(0.2, 50.0), (0.4, 1.0))]
POINTS = np.random.default_rng(1).uniform((0, 0), (200, 100), (50, 2))


@njit
def _call(kernel, theta, constants, x, y, t, velocity):
    call_flow(kernel, theta.ctypes, constants.ctypes, x, y, t, velocity.ctypes)


@pytest.mark.parametrize(("flow", "theta"), CASES)
def test_velocity_is_the_rotated_gradient_of_the_streamfunction(flow, theta):
    step = 1e-4
    dx, dy = np.array([step, 0]), np.array([0, step])

    def psi(x):
        return flow.streamfunction(theta, x, 3.3)

    u = -(psi(POINTS + dy) - psi(POINTS - dy)) / (2 * step)
    v = (psi(POINTS + dx) - psi(POINTS - dx)) / (2 * step)
    np.testing.assert_allclose(flow.velocity(theta, POINTS, 3.3), np.stack([u, v], axis=-1), atol=1e-6)


@pytest.mark.parametrize(("flow", "theta"), CASES)
def test_compiled_kernel_agrees_with_numpy(flow, theta):
    velocity = np.empty(2)
    for (x, y), expected in zip(POINTS, flow.velocity(theta, POINTS, 1.7), strict=True):
        _call(flow.kernel, np.array(theta), flow.constants, x, y, 1.7, velocity)
        np.testing.assert_allclose(velocity, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("flow", "theta"), CASES)
def test_factors_multiply_to_the_streamfunction(flow, theta):
    assert isinstance(flow, Separable)
    x, y, times = np.linspace(0, 200, 7), np.linspace(0, 100, 5), [0.0, 0.4, 2.0]
    of_x, of_y = flow.factors(theta, x, y, times)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    for time, level in zip(times, of_x, strict=True):
        product = np.einsum("rx,ry->xy", level, of_y).ravel()
        np.testing.assert_allclose(product, flow.streamfunction(theta, points, time), atol=1e-9)


@settings(deadline=None)
@given(st.floats(0, 0.5), st.floats(0.1, 1.3), st.floats(0, 10), st.floats(0, 1))
def test_no_water_crosses_the_walls_of_the_double_gyre(mu, omega, time, along):
    gyre = DoubleGyre()
    sides = gyre.velocity((mu, omega), [(0, 100 * along), (200, 100 * along)], time)[:, 0]
    ends = gyre.velocity((mu, omega), [(200 * along, 0), (200 * along, 100)], time)[:, 1]
    np.testing.assert_allclose([sides, ends], 0, atol=1e-12)


def test_gyre_without_displacement_turns_at_pi_amplitude_length():
    velocity = DoubleGyre().velocity((0.0, 1.0), [(50, 0), (0, 50)], 0.0)
    np.testing.assert_allclose(velocity, [(-10 * np.pi, 0), (0, 10 * np.pi)], atol=1e-12)


def test_uniform_flow_has_the_velocity_it_is_given():
    np.testing.assert_array_equal(UniformFlow().velocity((5, 4), POINTS, 0), np.tile([5.0, 4.0], (50, 1)))


def test_flow_survives_pickling():
    flow = DoubleGyre(0.2, 50.0)
    copy = pickle.loads(pickle.dumps(flow))
    assert copy == flow
    assert copy.kernel != 0


@pytest.mark.parametrize("bad", [{"amplitude": 0}, {"amplitude": "much"}, {"length": -1}])
def test_impossible_gyre_is_refused(bad):
    with pytest.raises(InvalidValue, match=next(iter(bad))):
        DoubleGyre(**bad)


def test_theta_of_the_wrong_size_is_refused():
    with pytest.raises(InvalidValue, match="theta"):
        DoubleGyre().velocity((0.1,), POINTS, 0.0)
