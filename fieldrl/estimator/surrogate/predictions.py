"""A Gaussian process on the vector of predictions: every sample's prediction as a function of the unknowns.

Each output has a constant mean, a variance and its own length scales, chosen from a fixed list by their
posterior probability, with mean and variance integrated out. One Cholesky factor for each entry of the
list serves all outputs, so that this costs no optimisation and cannot get stuck. Sums are written out
rather than left to BLAS: the number of threads changes no bit.

| symbol | meaning | shape | unit |
|---|---|---|---|
| u | scaled unknowns (theta - theta0) / s | (k, p) | half-width of the bounds |
| y | predictions there | (k, n) | field unit |
| l | length scales in the list | (c, p) | half-width |
| R = exp(-sum((u - u')/l)^2/2) + eta I | correlation | (k, k) | |
| A | inverse Cholesky factor, A^T A = R^-1 | (k, k) | |
| alpha = R^-1 (y - mean) | coefficients | (k, n) | field unit |
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.estimator.designs import length_scales

_NUGGET = 1e-10  # eta: keeps R positive where points nearly coincide
_TYPICAL, _SPREAD = 0.5, 1.0  # prior of a length scale: log-normal about this [half-width]
_SHAPE, _SHARE = 1.0, 0.05  # prior of a variance: inverse gamma, its scale a share of the pooled variance
_DISTRUST = 2.0  # variances of a surrogate that is not trusted are greater by this
_LEAST = 1e-12  # least share of the variance that is left anywhere


class Surrogate(NamedTuple):
    """The process given k solves of n outputs.

    Args:
        inputs: u, (k, p).
        inverse_scales: 1 / l of each output, (n, p).
        owner: the first output with the same length scales, (n,).
        roots: A of each output that is an owner, (n, k, k).
        coefficients: alpha, (k, n) [field unit].
        mean: (n,) [field unit].
        variance: (n,) [field unit^2].
    """

    inputs: NDArray[np.float64]
    inverse_scales: NDArray[np.float64]
    owner: NDArray[np.int64]
    roots: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    mean: NDArray[np.float64]
    variance: NDArray[np.float64]


class Evidence(NamedTuple):
    """What k solves say about the length scales.

    Args:
        inputs: u, (k, p).
        outputs: (k, n) [field unit].
        values: the samples', (n,) [field unit].
        scale: of the prior of a variance [field unit^2].
        scores: log probability of each entry of the list for each output, (c, n).
    """

    inputs: NDArray[np.float64]
    outputs: NDArray[np.float64]
    values: NDArray[np.float64]
    scale: float
    scores: NDArray[np.float64]


def evidence(
    inputs: NDArray[np.float64], outputs: NDArray[np.float64], values: NDArray[np.float64]
) -> Evidence:
    """How well each entry of the list explains ``outputs`` (k, n) [field unit] at ``inputs`` (k, p).

    The samples' ``values`` (n,) are what the outputs are somewhere in the box: they say how much an output
    varies, even where all solves agree.
    """
    scales = length_scales(inputs.shape[1])
    prior = -0.5 * np.sum((np.log(scales / _TYPICAL) / _SPREAD) ** 2, axis=1)
    pooled = float(np.mean((np.vstack([outputs, values]) - outputs.mean(axis=0)) ** 2))
    scale = _SHARE * pooled if pooled > 0 else 1.0
    inputs, outputs = np.ascontiguousarray(inputs), np.ascontiguousarray(outputs)
    return Evidence(inputs, outputs, values, scale, _scores(inputs, outputs, 1.0 / scales, prior, scale))


def condition(known: Evidence, caution: float = 0.0) -> Surrogate:
    """The surrogate given the solves.

    With ``caution`` each output has the shortest length scales (by their product) among those whose log
    probability is less than the greatest by at most so much.
    """
    inputs, outputs, values, scale, scores = known
    scales = length_scales(inputs.shape[1])
    choice = _choose(scores, np.sum(np.log(scales), axis=1), caution)
    inverse_scales = np.ascontiguousarray(1.0 / scales[choice])
    return Surrogate(
        inputs, inverse_scales, *_condition(inputs, outputs, values, choice, inverse_scales, scale)
    )


def predict(surrogate: Surrogate, u: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and standard deviation of the outputs at u (m, p): (m, n) each [field unit]."""
    mean, deviation = np.empty((2, len(u), len(surrogate.mean)))
    _predict(surrogate, np.ascontiguousarray(u), mean, deviation)
    return mean, deviation


def predict_mean(surrogate: Surrogate, u: NDArray[np.float64]) -> NDArray[np.float64]:
    """The mean alone, without the work for the deviation, (m, n) [field unit]."""
    mean = np.empty((len(u), len(surrogate.mean)))
    _predict(surrogate, np.ascontiguousarray(u), mean, mean[:0])
    return mean


def distrusted(surrogate: Surrogate) -> Surrogate:
    """The same with variances that its own errors speak for, and twice that, since few errors tell of them.

    The error at a solve that is left out, squared, is on average its variance (Rasmussen & Williams 2006,
    section 5.4.2). Solves that lie alone count most: what one close to another says of errors far away is
    little. One factor, at least 1, serves all outputs.
    """
    seen, expected = 0.0, 0.0
    for j, owner in enumerate(surrogate.owner):
        precision = np.sum(surrogate.roots[owner] ** 2, axis=0)  # of a solve given the others
        seen += float(np.sum((surrogate.coefficients[:, j] / precision) ** 2)) / surrogate.variance[j]
        expected += float(np.sum(1.0 / precision))
    factor = _DISTRUST * max(seen / expected, 1.0)
    return surrogate._replace(variance=factor * surrogate.variance)


@njit(cache=True, error_model="numpy")
def linearise(surrogate, u, mean, slope):
    """Mean of the outputs at u (p,) and its derivatives, in place, (n,) and (n, p)."""
    inputs, inverse_scales, owner, _, coefficients, constant, _ = surrogate
    n, p = inverse_scales.shape
    mean[:], slope[:] = constant, 0.0
    for o in range(n):
        if owner[o] != o:
            continue
        inverse = inverse_scales[o]
        for i in range(len(inputs)):
            r = _correlation(u, inputs[i], inverse)
            for j in range(o, n):
                if owner[j] == o:
                    part = r * coefficients[i, j]
                    mean[j] += part
                    for q in range(p):
                        slope[j, q] -= part * (u[q] - inputs[i, q]) * inverse[q] * inverse[q]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def covary(surrogate, u, covariance):
    """Covariance of every output at u (p,) and its derivatives, in place, (n, 1 + p, 1 + p), output first.

    A process and its derivatives are jointly normal: the covariance of r with them is the derivative of r
    (Rasmussen & Williams 2006, section 9.4). Units: field unit^2, by half-width for each derivative.
    """
    inputs, inverse_scales, owner, roots, _, _, variance = surrogate
    (n, p), k = inverse_scales.shape, len(inputs)
    rows, white = np.empty((1 + p, k)), np.empty((1 + p, k))
    for j in range(n):
        if owner[j] != j:
            share = variance[j] / variance[owner[j]]
            covariance[j] = share * covariance[owner[j]]
            continue
        inverse = inverse_scales[j]
        for i in range(k):
            rows[0, i] = _correlation(u, inputs[i], inverse)
            for q in range(p):
                rows[1 + q, i] = -rows[0, i] * (u[q] - inputs[i, q]) * inverse[q] * inverse[q]
        for a in range(1 + p):
            for i in range(k):
                total = 0.0
                for m in range(i + 1):
                    total += roots[j, i, m] * rows[a, m]
                white[a, i] = total
        for a in range(1 + p):
            prior = 1.0 if a == 0 else inverse[a - 1] * inverse[a - 1]
            for b in range(a + 1):
                left = prior if a == b else 0.0
                for i in range(k):
                    left -= white[a, i] * white[b, i]
                if a == b:
                    left = max(left, _LEAST * prior)
                covariance[j, a, b] = covariance[j, b, a] = variance[j] * left


@njit(cache=True, error_model="numpy")
def _correlation(u, v, inverse):
    total = 0.0
    for q in range(u.size):
        d = (u[q] - v[q]) * inverse[q]
        total += d * d
    return math.exp(-0.5 * total)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _factorise(inputs, inverse, factor):
    """Lower Cholesky factor of R, in place; False where R is not positive."""
    for i in range(len(inputs)):
        for j in range(i + 1):
            total = 1.0 + _NUGGET if i == j else _correlation(inputs[i], inputs[j], inverse)
            for m in range(j):
                total -= factor[i, m] * factor[j, m]
            if i == j:
                if total <= 0.0:
                    return False
                factor[i, i] = math.sqrt(total)
            else:
                factor[i, j] = total / factor[j, j]
    return True


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _whiten(factor, rows):
    """Solve factor x = rows (k, any) in place."""
    for i in range(len(rows)):
        for m in range(i):
            for j in range(rows.shape[1]):
                rows[i, j] -= factor[i, m] * rows[m, j]
        for j in range(rows.shape[1]):
            rows[i, j] /= factor[i, i]


@njit(cache=True, error_model="numpy")
def _scores(inputs, outputs, inverses, prior, scale):
    """Log probability of each entry of the list for each output, (c, n), mean and variance integrated out."""
    k, n = outputs.shape
    factor, rows = np.empty((k, k)), np.empty((k, n + 1))
    scores = np.full((len(inverses), n), -np.inf)
    for c in range(len(inverses)):
        if not _factorise(inputs, inverses[c], factor):
            continue
        rows[:, :n], rows[:, n] = outputs, 1.0
        _whiten(factor, rows)
        common, ones = prior[c], 0.0
        for i in range(k):
            common -= math.log(factor[i, i])
            ones += rows[i, n] * rows[i, n]
        common -= 0.5 * math.log(ones)
        for j in range(n):
            along, square = 0.0, 0.0
            for i in range(k):
                along += rows[i, n] * rows[i, j]
                square += rows[i, j] * rows[i, j]
            rest = max(square - along * along / ones, 0.0) + 2.0 * scale
            scores[c, j] = common - 0.5 * (k - 1 + 2.0 * _SHAPE) * math.log(rest)
    return scores


def _choose(scores: NDArray, lengths: NDArray, caution: float) -> NDArray[np.int64]:
    """The entry with the least ``lengths`` (c,) within ``caution`` of the best score (c, n): (n,)."""
    probable = scores >= scores.max(axis=0) - caution
    return np.argmin(np.where(probable, lengths[:, None], np.inf), axis=0)


@njit(cache=True, error_model="numpy")
def _condition(inputs, outputs, values, choice, inverse_scales, scale):
    """Owner, roots, coefficients, mean and variance of a surrogate with chosen length scales."""
    k, n = outputs.shape
    owner, roots, factor = np.empty(n, dtype=np.int64), np.zeros((n, k, k)), np.empty((k, k))
    coefficients, mean, variance = np.empty((k, n)), np.empty(n), np.empty(n)
    ones, white = np.empty(k), np.empty(k)
    for j in range(n):
        owner[j] = _first(choice, j)
        root = roots[owner[j]]
        if owner[j] == j:
            _factorise(inputs, inverse_scales[j], factor)
            for i in range(k):
                root[i, i] = 1.0
            _whiten(factor, root)
        _multiply(root, outputs[:, j], white)
        for i in range(k):
            ones[i] = root[i, : i + 1].sum()
        mean[j] = (ones * white).sum() / (ones * ones).sum()
        white -= mean[j] * ones
        square = (white * white).sum() + (values[j] - mean[j]) ** 2
        variance[j] = (square + 2.0 * scale) / (k + 2.0 * _SHAPE)
        for i in range(k):
            coefficients[i, j] = (root[i:, i] * white[i:]).sum()
    return owner, roots, coefficients, mean, variance


@njit(cache=True)
def _first(choice, j):
    """The first output with the length scales of output j."""
    for i in range(j):
        if choice[i] == choice[j]:
            return i
    return j


@njit(cache=True, error_model="numpy")
def _multiply(root, vector, product):
    """Lower triangular matrix times vector, in place."""
    for i in range(len(root)):
        product[i] = (root[i, : i + 1] * vector[: i + 1]).sum()


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _predict(surrogate, u, mean, deviation):
    """Mean and, where ``deviation`` has rows, standard deviation, in place."""
    inputs, inverse_scales, owner, roots, coefficients, constant, variance = surrogate
    k, n = coefficients.shape
    r, left = np.empty((n, k)), np.empty(n)
    for c in range(len(u)):
        for j in range(n):
            if owner[j] == j:
                for i in range(k):
                    r[j, i] = _correlation(u[c], inputs[i], inverse_scales[j])
                if len(deviation):
                    left[j] = _unexplained(roots[j], r[j])
            total = constant[j]
            for i in range(k):
                total += r[owner[j], i] * coefficients[i, j]
            mean[c, j] = total
            if len(deviation):
                deviation[c, j] = math.sqrt(left[owner[j]] * variance[j])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz", "arcp"})
def _unexplained(root, r):
    """1 - |A r|^2, the share of the variance that the solves leave."""
    left = 1.0
    for i in range(r.size):
        along = 0.0
        for m in range(i + 1):
            along += root[i, m] * r[m]
        left -= along * along
    return max(left, _LEAST)
