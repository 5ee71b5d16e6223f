"""Compiled functions called by their address."""

import numpy as np
from numba import carray, cfunc, njit

from fieldrl.core.compiled import FLOW, MODEL, call_flow, call_model


@cfunc(FLOW)
def _shear(theta, constants, x, y, t, velocity):
    velocity[0] = theta[0] * y + constants[0]
    velocity[1] = x + t


@cfunc(FLOW)
def _still(theta, constants, x, y, t, velocity):
    velocity[0] = velocity[1] = 0.0


@cfunc(MODEL)
def _plane(theta, m, positions, times, n, constants, prediction, jacobian):
    candidates, x = carray(theta, (m, 2)), carray(positions, (n, 2))
    values, slopes = carray(prediction, (m, n)), carray(jacobian, (m, n, 2))
    for k in range(m):
        for i in range(n):
            values[k, i] = candidates[k, 0] * x[i, 0] + candidates[k, 1] * x[i, 1] + constants[0] * times[i]
            slopes[k, i] = x[i]


@njit
def velocity_at(address, theta, constants, x, y, t):
    velocity = np.empty(2)
    call_flow(address, theta.ctypes, constants.ctypes, x, y, t, velocity.ctypes)
    return velocity


@njit
def predicted(address, theta, positions, times, constants):
    (m, p), n = theta.shape, times.size
    values, slopes = np.empty((m, n)), np.empty((m, n, p))
    x, t, c = positions.ctypes, times.ctypes, constants.ctypes
    call_model(address, theta.ctypes, m, x, t, n, c, values.ctypes, slopes.ctypes)
    return values, slopes


def test_one_compiled_caller_serves_every_flow():
    theta, constants = np.array([2.0]), np.array([0.5])
    assert np.array_equal(velocity_at(_shear.address, theta, constants, 3.0, 4.0, 1.0), [8.5, 4.0])
    assert np.array_equal(velocity_at(_still.address, theta, constants, 3.0, 4.0, 1.0), [0.0, 0.0])
    assert len(velocity_at.signatures) == 1


def test_a_model_fills_prediction_and_jacobian():
    positions, times = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]), np.array([0.0, 1.0, 2.0])
    theta = np.array([[10.0, 1.0], [0.0, 1.0]])
    values, slopes = predicted(_plane.address, theta, positions, times, np.array([100.0]))
    assert np.array_equal(values, [[12.0, 134.0, 256.0], [2.0, 104.0, 206.0]])
    assert np.array_equal(slopes, [positions, positions])
