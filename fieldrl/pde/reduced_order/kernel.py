"""The reduced model, compiled: predictions, their derivatives, and whole fields.

A sample's prediction as a function of the unknowns is one tensor spline; its coefficients, a table, follow
from the modes at the sample's place. Tables are kept for the samples that were asked for last: a memo, which
changes no result by a bit. Each evaluation then takes 6^p numbers of a table. Candidates that differ in the
last unknown alone, as those of a coarse grid do, have the sums over rows in common, a line; and lines of a
grid have their places in common.

| symbol | meaning | shape |
|---|---|---|
| constants | the model, see ``packing`` | |
| values, slopes | the 6 B-splines of each axis that are not zero at u, and their derivatives | (p, 6) |
| places | rows of a table: pairs (triples, ...) of the B-splines of all axes but the last | (6^(p - 1),) |
| products | of these B-splines, with the derivative along axis k; the last ones without | (p, 6^(p - 1)) |
| line | coefficients along the last axis: sums over rows, times their products | (p, N_p) |
| on line | last unknown of each of its candidates, its first B-spline, values and slopes | (m, 2 + 12) |
"""

from __future__ import annotations

import numpy as np
from numba import carray, cfunc, njit  # pyright: ignore[reportPrivateImportUsage]

from fieldrl.core.compiled import MODEL, loop
from fieldrl.pde.finite_volumes.sampling import POLYNOMIALS
from fieldrl.pde.finite_volumes.sampling import WIDTH as REACH
from fieldrl.pde.reduced_order.packing import (
    AXES_AT,
    AXIS,
    BINS,
    BLOCK,
    CALLS,
    HIGH,
    LABEL,
    LABELS_AT,
    LEFT,
    LOW,
    NX,
    NY,
    SIZE,
    SLOTS,
    TABLE,
    TABLES_AT,
    TIME,
    TIMES,
    TIMES_AT,
    WIDE,
    P,
)
from fieldrl.pde.reduced_order.splines import WIDTH

_PROBES = 16  # places of the memo where a sample may be
_LINE = 6  # candidates on a line for which its coefficients pay
_SAME_TIME = 1e-9


@njit(cache=True, error_model="numpy")
def evaluate(theta, positions, times, constants):
    """Predictions (m, n) and Jacobian (m, n, p) at theta (m, p); NaN at other times than the model's."""
    m, n, p = theta.shape[0], times.size, theta.shape[1]
    prediction, jacobian = np.empty((m, n)), np.empty((m, n, p))
    _predict(theta, positions, times, constants, prediction, jacobian)
    return prediction, jacobian


@njit(cache=True, error_model="numpy")
def state(theta, which, constants):
    """Cell averages at time number ``which`` and theta (p,), (nx * ny,)."""
    scratch, candidates = _scratch(theta.size), theta.reshape(1, -1)
    base = _lead(candidates, 0, constants, scratch) + _last(candidates, 0, constants, scratch)
    at = int(constants[TIMES_AT]) + TIME * which
    rank, cells = int(constants[at + 1]), int(constants[NX] * constants[NY])
    modes = _single(constants, int(constants[at + 2]), cells * rank)
    size = int(constants[TABLE])
    of_spline = _single(constants, int(constants[at + 3]), rank * size)
    weights, field = np.empty(rank), np.zeros(cells)
    for r in range(rank):
        weights[r], _, _ = _sums(
            of_spline, r * size + base, scratch[2], scratch[3], 0, scratch[0], scratch[1]
        )
    for cell in range(cells):
        for r in range(rank):
            field[cell] += weights[r] * modes[cell * rank + r]
    return field


@njit(cache=True, error_model="numpy")
def _predict(theta, positions, times, constants, prediction, jacobian):
    """As ``evaluate``, in place; as many samples at a time as the memo surely holds."""
    n, chunk = times.size, SLOTS // 2
    tables = np.empty(min(n, chunk), dtype=np.int64)
    scratch = _scratch(theta.shape[1])
    for begin in range(0, n, chunk):
        end = min(n, begin + chunk)
        constants[CALLS] += 1.0
        for j in range(begin, end):
            tables[j - begin] = _table(positions[j, 0], positions[j, 1], times[j], constants)
        if theta.shape[0] >= _LINE:
            _on_lines(theta, constants, tables, scratch, prediction, jacobian, begin, end)
            continue
        for i in range(theta.shape[0]):
            leading = _lead(theta, i, constants, scratch)
            _at_point(theta, i, constants, leading, tables, scratch, prediction, jacobian, begin, end)


@njit(cache=True, error_model="numpy")
def _scratch(p):
    """Values and slopes of each axis, then rows: places, products, products with a derivative."""
    rows = WIDTH ** (p - 1)
    values, slopes = np.empty((p, WIDTH)), np.empty((p, WIDTH))
    return values, slopes, np.empty(rows, dtype=np.int64), np.empty((p, rows))


@loop
def _end_of_line(theta, i):
    """The first candidate after i that differs from it in more than the last unknown; m if there is none."""
    for other in range(i + 1, theta.shape[0]):
        for k in range(theta.shape[1] - 1):
            if theta[other, k] != theta[i, k]:
                return other
    return theta.shape[0]


@loop
def _lead(theta, i, constants, scratch):
    """B-splines of all axes but the last, and rows, in place; returns where in a table the first ones are."""
    values, slopes, places, products = scratch
    last, base = theta.shape[1] - 1, 0
    for k in range(last):
        base += _basis(theta[i, k], constants, k, values, slopes) * _stride(constants, k)
    places[0], products[:, 0], rows = 0, 1.0, 1
    for k in range(last):  # each row becomes WIDTH rows, from the last one on
        stride = _stride(constants, k)
        for row in range(rows - 1, -1, -1):
            for b in range(WIDTH - 1, -1, -1):
                places[row * WIDTH + b] = places[row] + b * stride
            for along in range(last + 1):  # products with the derivative along an axis, then without
                product = products[along, row]
                for b in range(WIDTH):
                    factor = slopes[k, b] if k == along else values[k, b]
                    products[along, row * WIDTH + b] = product * factor
        rows *= WIDTH
    return base


@loop
def _last(theta, i, constants, scratch):
    """B-splines of the last axis, in place; returns the number of the first."""
    last = theta.shape[1] - 1
    return _basis(theta[i, last], constants, last, scratch[0], scratch[1])


@loop
def _stride(constants, k):
    return int(constants[int(constants[AXES_AT]) + AXIS * k + 1])


@loop
def _basis(theta, constants, k, values, slopes):
    """B-splines of axis k and their derivatives, in place; returns the number of the first."""
    at = int(constants[AXES_AT]) + AXIS * k
    scale, breaks = constants[at + 6], int(constants[at + 3])
    u = (theta - constants[at + 5]) / scale
    guess = min(max(int((u + 1.0) * (BINS // 2)), 0), BINS - 1)
    piece = int(constants[int(constants[at + 7]) + guess])
    while piece + 1 < constants[at + 2] and constants[breaks + piece + 1] <= u:
        piece += 1
    s, first = u - constants[breaks + piece], np.uint64(int(constants[at + 4]) + WIDTH * WIDTH * piece)
    for b in range(WIDTH):  # Horner's scheme; unsigned: never from the end
        value, slope, place = 0.0, 0.0, first + np.uint64(WIDTH * (WIDTH - 1) + b)
        for _ in range(WIDTH):
            slope = slope * s + value
            value = value * s + constants[place]
            place -= np.uint64(WIDTH)
        values[k, b], slopes[k, b] = value, slope / scale
    return piece


@loop
def _spline(table, base, scratch, prediction, jacobian, i, j):
    """The tensor spline whose coefficients begin at ``base``, and its derivatives, in place."""
    values, slopes, places, products = scratch
    last = values.shape[0] - 1
    prediction[i, j], jacobian[i, j, last], slope = _sums(table, base, places, products, 0, values, slopes)
    if last > 0:
        jacobian[i, j, 0] = slope
    for k in range(1, last):
        _, _, jacobian[i, j, k] = _sums(table, base, places, products, k, values, slopes)


@njit(cache=True, error_model="numpy")
def _on_lines(theta, constants, tables, scratch, prediction, jacobian, begin, end):
    """``_at_point`` of many candidates, with the same additions, in place; lines of a few pay."""
    m, last = theta.shape[0], theta.shape[1] - 1
    on_line = np.full((m, 2 + 2 * WIDTH), np.nan)
    line = np.empty((last + 1, _stride(constants, last - 1) if last else int(constants[TABLE])))
    i = 0
    while i < m:
        leading, beyond = _lead(theta, i, constants, scratch), _end_of_line(theta, i)
        if beyond - i >= _LINE:
            _place(theta, i, beyond, constants, scratch, on_line)
            for j in range(begin, end):
                _add_up(constants, tables[j - begin] + leading, scratch, line)
                _along(line, on_line, prediction, jacobian, i, beyond, j)
            i = beyond
        while i < beyond:
            _at_point(theta, i, constants, leading, tables, scratch, prediction, jacobian, begin, end)
            i += 1


@loop
def _at_point(theta, i, constants, leading, tables, scratch, prediction, jacobian, begin, end):
    """Candidate i at samples ``begin`` to ``end``, in place."""
    base = leading + _last(theta, i, constants, scratch)
    for j in range(begin, end):
        _spline(constants, tables[j - begin] + base, scratch, prediction, jacobian, i, j)


@loop
def _place(theta, begin, beyond, constants, scratch, on_line):
    """Bring ``on_line`` up to date with a line's candidates."""
    last = theta.shape[1] - 1
    for i in range(begin, beyond):
        row = on_line[i - begin]
        if row[0] != theta[i, last]:
            row[0], row[1] = theta[i, last], _last(theta, i, constants, scratch)
            for b in range(WIDTH):
                row[2 + b], row[2 + WIDTH + b] = scratch[0][last, b], scratch[1][last, b]


@loop
def _add_up(constants, table, scratch, line):
    """The line's coefficients, in place."""
    _, _, places, products = scratch
    line[:] = 0.0
    for row in range(places.size):
        first = np.uint64(table + places[row])  # unsigned: never from the end
        for along in range(line.shape[0]):
            product = products[along, row]
            for g in range(line.shape[1]):
                line[along, g] += product * constants[first + np.uint64(g)]


@loop
def _along(line, on_line, prediction, jacobian, begin, beyond, j):
    """The splines on a line, and their derivatives, at sample j, in place."""
    last = line.shape[0] - 1
    for i in range(begin, beyond):
        row = on_line[i - begin]
        first = np.uint64(row[1])  # unsigned: never from the end
        prediction[i, j] = _dot(line[last], first, row, 2)
        jacobian[i, j, last] = _dot(line[last], first, row, 2 + WIDTH)
        for k in range(last):
            jacobian[i, j, k] = _dot(line[k], first, row, 2)


@loop
def _dot(line, first, row, at):
    """What the B-splines from ``at`` on in a row of ``on_line`` make of the line's coefficients."""
    total = line[first] * row[at]
    for b in range(1, WIDTH):
        total += line[first + np.uint64(b)] * row[at + b]
    return total


@loop
def _sums(table, base, places, products, along, values, slopes):
    """The spline, its derivatives along the last and another axis: sums over rows, then the last axis."""
    plain, derived, v, d = products[-1], products[along], values[-1], slopes[-1]
    s0, s1, s2, s3, s4, s5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    t0, t1, t2, t3, t4, t5 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for row in range(places.size):
        at, a, b = np.uint64(base + places[row]), plain[row], derived[row]  # unsigned: never from the end
        c0, c1, c2 = table[at], table[at + np.uint64(1)], table[at + np.uint64(2)]
        c3, c4, c5 = table[at + np.uint64(3)], table[at + np.uint64(4)], table[at + np.uint64(5)]
        s0, s1, s2, s3, s4, s5 = s0 + a * c0, s1 + a * c1, s2 + a * c2, s3 + a * c3, s4 + a * c4, s5 + a * c5
        t0, t1, t2, t3, t4, t5 = t0 + b * c0, t1 + b * c1, t2 + b * c2, t3 + b * c3, t4 + b * c4, t5 + b * c5
    value = s0 * v[0] + s1 * v[1] + s2 * v[2] + s3 * v[3] + s4 * v[4] + s5 * v[5]
    slope = s0 * d[0] + s1 * d[1] + s2 * d[2] + s3 * d[3] + s4 * d[4] + s5 * d[5]
    return value, slope, t0 * v[0] + t1 * v[1] + t2 * v[2] + t3 * v[3] + t4 * v[4] + t5 * v[5]


@njit(cache=True, error_model="numpy")
def _table(x, y, t, constants):
    """Where the table of a sample is; made where the memo does not hold it."""
    labels, size = int(constants[LABELS_AT]), int(constants[TABLE])
    first, free = int(abs(7919.0 * x + 104729.0 * y + 1299709.0 * t)) % SLOTS, -1
    for probe in range(SLOTS):
        slot = (first + probe) % SLOTS
        at = labels + LABEL * slot
        if constants[at] == x and constants[at + 1] == y and constants[at + 2] == t:
            constants[at + 3] = constants[CALLS]
            return int(constants[TABLES_AT]) + size * slot
        if free < 0 and constants[at + 3] != constants[CALLS]:  # no sample of this call needs it
            free = slot
        if probe >= _PROBES and free >= 0:
            break
    at, table = labels + LABEL * free, int(constants[TABLES_AT]) + size * free
    constants[at], constants[at + 1], constants[at + 2], constants[at + 3] = x, y, t, constants[CALLS]
    _tabulate(x, y, t, constants, constants[table : table + size])
    return table


@njit(cache=True, error_model="numpy")
def _tabulate(x, y, t, constants, table):
    """Coefficients of a sample's prediction, in place."""
    which = _number(t, constants)
    if which < 0:
        table[:] = np.nan
        return
    at, size = int(constants[TIMES_AT]) + TIME * which, table.size
    rank, cells = int(constants[at + 1]), int(constants[NX] * constants[NY])
    modes = _single(constants, int(constants[at + 2]), cells * rank)
    here, total = np.zeros(rank, dtype=np.float32), np.zeros(size, dtype=np.float32)
    _sample(x, y, constants, modes, rank, here)
    of_spline = _single(constants, int(constants[at + 3]), rank * size)
    for r in range(0, rank, BLOCK):
        _add(of_spline[r * size : (r + BLOCK) * size].reshape(BLOCK, size), here[r : r + BLOCK], total)
    table[:] = total


@njit(cache=True, error_model="numpy")
def _add(of_spline, here, total):
    """BLOCK modes' part of a table; rows of their own, so that the loop becomes vector instructions."""
    first, second, third, fourth = of_spline[0], of_spline[1], of_spline[2], of_spline[3]
    a, b, c, d = here[0], here[1], here[2], here[3]
    for g in range(total.size):
        total[g] += a * first[g] + b * second[g] + c * third[g] + d * fourth[g]


@njit(cache=True, error_model="numpy")
def _number(t, constants):
    """Which of the model's times t is; -1 where it is none."""
    for which in range(int(constants[TIMES])):
        if abs(constants[int(constants[TIMES_AT]) + TIME * which] - t) <= _SAME_TIME:
            return which
    return -1


@njit(cache=True, error_model="numpy")
def _sample(x, y, constants, modes, rank, here):
    """Modes at a point, in single precision, written into ``here``."""
    nx, ny = int(constants[NX]), int(constants[NY])
    columns, across = _stencil(x, constants[LEFT], constants[WIDE], nx)
    rows, along = _stencil(y, constants[LOW], constants[HIGH], ny)
    for i in range(REACH):
        for j in range(REACH):
            weight, first = np.float32(across[i] * along[j]), (columns[i] * ny + rows[j]) * rank
            there = modes[first : first + rank]
            for r in range(rank):
                here[r] += weight * there[r]


@njit(cache=True, error_model="numpy")
def _stencil(point, low, cell, cells):
    """As ``sampling.stencil``, of one point: cells and weights, (REACH,) each."""
    position = (point - low) / cell
    nearest = min(max(int(np.floor(position)), 0), cells - 1)
    xi, power = position - nearest - 0.5, 1.0
    weights, indices = np.zeros(REACH), np.empty(REACH, dtype=np.int64)
    for k in range(REACH):
        for i in range(REACH):
            weights[i] += power * POLYNOMIALS[i, k]
        power *= xi
    for i in range(REACH):
        index = (nearest + i - REACH // 2) % (2 * cells)
        indices[i] = min(index, 2 * cells - 1 - index)
    return indices, weights


@njit(cache=True, error_model="numpy")
def _single(constants, begin, count):
    """``count`` numbers in single precision."""
    return constants[begin : begin + (count + 1) // 2].view(np.float32)


@cfunc(MODEL, cache=True)
def kernel(theta, m, positions, times, n, constants, prediction, jacobian):
    """The MODEL function."""
    head = carray(constants, (SIZE + 1,))
    p = int(head[P])
    _predict(
        carray(theta, (m, p)),
        carray(positions, (n, 2)),
        carray(times, (n,)),
        carray(constants, (int(head[SIZE]),)),
        carray(prediction, (m, n)),
        carray(jacobian, (m, n, p)),
    )
