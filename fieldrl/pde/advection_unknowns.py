"""The closed form of ``advection`` with its derivatives by every number of the model, compiled.

Column k of the gradient of f (Eq. 2) is the derivative by number k of

    b_x, b_y | a, c_x, c_y, sigma, q of the feature | strength, c_x, c_y, width, opens, closes of the source

A candidate gives some of them, the constants the others.

| symbol | meaning | shape |
|---|---|---|
| numbers | all numbers of the model | (13,) |
| gradient | derivatives by them | (13,) |
| constants | numbers, p, places of the unknowns, whether there is a source, quadrature, nodes, weights | |
"""

from __future__ import annotations

import math

import numpy as np
from numba import carray, cfunc, njit  # pyright: ignore[reportPrivateImportUsage]

from fieldrl.core.compiled import MODEL

NUMBERS = 13
_COUNT, _PLACES = NUMBERS, NUMBERS + 1
_REACH = 6.5  # widths beyond which a Gaussian source is below 1e-18 of its strength


@njit(cache=True, error_model="numpy")
def evaluate(theta, positions, times, constants):
    """Predictions (m, n) and derivatives by the unknowns (m, n, p) at theta (m, p)."""
    m, n, p = theta.shape[0], times.size, theta.shape[1]
    prediction, jacobian = np.empty((m, n)), np.empty((m, n, p))
    _advect(theta, positions, times, constants, prediction, jacobian)
    return prediction, jacobian


@njit(cache=True, error_model="numpy")
def _advect(theta, positions, times, constants, prediction, jacobian):
    """Eq. (2) and its derivatives for m candidates at n samples, in place."""
    numbers, gradient, p = constants[:NUMBERS].copy(), np.empty(NUMBERS), theta.shape[1]
    source = constants[_PLACES + p] != 0.0
    for m in range(theta.shape[0]):
        for k in range(p):
            numbers[int(constants[_PLACES + k])] = theta[m, k]
        for i in range(times.size):
            f = _feature(positions[i, 0], positions[i, 1], times[i], numbers, gradient)
            if source:
                f += _duhamel(positions[i, 0], positions[i, 1], times[i], numbers, constants, p, gradient)
            prediction[m, i] = f
            for k in range(p):
                jacobian[m, i, k] = gradient[int(constants[_PLACES + k])]


@njit(cache=True, error_model="numpy")
def _feature(x, y, t, numbers, gradient):
    """h(x - t b) and its derivatives, Eq. (26); the source's are set to 0."""
    a, scale, q = numbers[2], numbers[5], numbers[6]
    dx, dy = (x - t * numbers[0] - numbers[3]) / scale, (y - t * numbers[1] - numbers[4]) / scale
    px, py = abs(dx) ** q, abs(dy) ** q
    shape = math.exp(-(px + py))
    h = a * shape
    slope_x, slope_y = _slope(dx, q) * h / scale, _slope(dy, q) * h / scale
    gradient[0], gradient[1] = t * slope_x, t * slope_y
    gradient[2], gradient[3], gradient[4] = shape, slope_x, slope_y
    gradient[5] = h * q * (px + py) / scale
    gradient[6] = -h * (_times_log(px, dx) + _times_log(py, dy))
    gradient[7:] = 0.0
    return h


@njit(cache=True, error_model="numpy")
def _slope(d, q):
    """Derivative of |d|^q; 0 at the crease of q = 1."""
    return q * np.sign(d) * abs(d) ** (q - 1.0)


@njit(cache=True, error_model="numpy")
def _times_log(power, d):
    """|d|^q log |d|, 0 at d = 0."""
    return power * math.log(abs(d)) if d != 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def _duhamel(x, y, t, numbers, constants, p, gradient):
    """Duhamel's integral and its derivatives; the nodes are spread where the integrand is not negligible."""
    bx, by, strength, width = numbers[0], numbers[1], numbers[7], numbers[10]
    dx, dy = x - t * bx - numbers[8], y - t * by - numbers[9]
    begin, end = numbers[11], min(t, numbers[12])
    if end <= begin:
        return 0.0
    gradient[11] = -strength * _rate(dx, dy, bx, by, begin, width)
    gradient[12] = strength * _rate(dx, dy, bx, by, end, width) if numbers[12] < t else 0.0
    speed2 = bx * bx + by * by
    if speed2 > 0.0:
        nearest, reach = -(dx * bx + dy * by) / speed2, _REACH * width / math.sqrt(speed2)
        begin, end = max(begin, nearest - reach), min(end, nearest + reach)
    if end <= begin:
        return 0.0
    at = _PLACES + p + 1
    count, half = int(constants[at]), 0.5 * (end - begin)
    total, along_x, along_y, later_x, later_y, square = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        s = 0.5 * (begin + end) + half * constants[at + 1 + k]
        ux, uy = (dx + s * bx) / width, (dy + s * by) / width
        rate = half * constants[at + 1 + count + k] * math.exp(-(ux * ux + uy * uy))
        total += rate
        along_x += 2.0 * rate * ux
        along_y += 2.0 * rate * uy
        later_x += 2.0 * rate * ux * (t - s)
        later_y += 2.0 * rate * uy * (t - s)
        square += 2.0 * rate * (ux * ux + uy * uy)
    per = strength / width
    gradient[0] += per * later_x
    gradient[1] += per * later_y
    gradient[7], gradient[8], gradient[9] = total, per * along_x, per * along_y
    gradient[10] = per * square
    return strength * total


@njit(cache=True, error_model="numpy")
def _rate(dx, dy, bx, by, s, width):
    """The source of strength 1 that the water meets at time s."""
    ux, uy = (dx + s * bx) / width, (dy + s * by) / width
    return math.exp(-(ux * ux + uy * uy))


@cfunc(MODEL, cache=True)
def kernel(theta, m, positions, times, n, constants, prediction, jacobian):
    """The MODEL function."""
    p = int(constants[_COUNT])
    count = int(constants[_PLACES + p + 1])
    _advect(
        carray(theta, (m, p)),
        carray(positions, (n, 2)),
        carray(times, (n,)),
        carray(constants, (_PLACES + p + 2 + 2 * count,)),
        carray(prediction, (m, n)),
        carray(jacobian, (m, n, p)),
    )
