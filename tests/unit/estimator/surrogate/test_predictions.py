"""The surrogate of the predictions, and the doubts that it leaves."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.estimator.surrogate.predictions import (
    condition,
    covary,
    distrusted,
    evidence,
    linearise,
    predict,
)


@pytest.fixture(scope="module", params=[1, 2, 3], ids=lambda p: f"{p} unknowns")
def surrogate(request):
    """Of four outputs, two of them alike, from five solves."""
    rng = np.random.default_rng(1)
    u = rng.uniform(-1, 1, (5, request.param))
    outputs = np.sin(u @ rng.normal(size=(request.param, 3)))[:, [0, 1, 2, 2]] * [1.0, 2.0, 3.0, 6.0]
    return condition(evidence(u, outputs, outputs[0] + 0.1), caution=4.0)


def doubts(surrogate, u):
    n, p = surrogate.inverse_scales.shape
    covariance = np.empty((n, 1 + p, 1 + p))
    covary(surrogate, u, covariance)
    return covariance


def test_slopes_are_those_of_the_mean(surrogate):
    n, p = surrogate.inverse_scales.shape
    u, mean, slope = np.full(p, 0.2), np.empty(n), np.empty((n, p))
    linearise(surrogate, u, mean, slope)
    steps = 1e-5 * np.eye(p)
    above, below = predict(surrogate, u + steps)[0], predict(surrogate, u - steps)[0]
    assert mean == pytest.approx(predict(surrogate, u[None])[0][0])
    difference = (above - below).T / 2e-5
    assert slope == pytest.approx(difference, rel=1e-5, abs=1e-5)


def test_the_doubt_about_slopes_is_that_about_differences(surrogate):
    """Of f(u + h) - f(u) the covariance comes from the surrogate's own kernel, written out here."""
    p = surrogate.inputs.shape[1]
    u, h, axes = np.full(p, 0.2), 3e-3, np.eye(p)
    points = np.vstack([u, u + h * axes, u - h * axes])
    contrast = np.zeros((1 + p, 1 + 2 * p))
    contrast[0, 0], contrast[1:, 1 : 1 + p], contrast[1:, 1 + p :] = 1.0, axes / (2 * h), -axes / (2 * h)
    for j, found in enumerate(doubts(surrogate, u)):

        def kernel(a, b, inverse=surrogate.inverse_scales[j]):
            return np.exp(-0.5 * np.sum(((a[:, None] - b) * inverse) ** 2, axis=2))

        known = kernel(surrogate.inputs, surrogate.inputs) + 1e-10 * np.eye(len(surrogate.inputs))
        across = kernel(surrogate.inputs, points)
        left = kernel(points, points) - across.T @ np.linalg.solve(known, across)
        expected = surrogate.variance[j] * contrast @ left @ contrast.T
        assert found == pytest.approx(expected, rel=2e-3, abs=2e-3 * expected.max())


def test_at_a_solve_the_value_is_known_and_the_slopes_are_not(surrogate):
    covariance = doubts(surrogate, surrogate.inputs[3])
    assert np.all(covariance[:, 0, 0] < 1e-8 * surrogate.variance)
    assert np.all(np.linalg.eigvalsh(covariance)[:, -1] > 1e-6 * surrogate.variance)
    _, deviation = predict(surrogate, np.full((1, surrogate.inputs.shape[1]), 0.2))
    there = doubts(surrogate, np.full(surrogate.inputs.shape[1], 0.2))
    assert np.sqrt(there[:, 0, 0]) == pytest.approx(deviation[0])


def test_a_surrogate_that_its_own_errors_contradict_is_distrusted():
    """Each solve is predicted from the others with the same mean, variance and length scales, written out."""
    rng = np.random.default_rng(0)
    u = np.vstack([rng.uniform(-1, 1, (6, 2)), [0.9, 0.9] + 0.05 * rng.uniform(-1, 1, (20, 2))])
    outputs = np.vstack([rng.normal(size=(6, 2)), np.zeros((20, 2))]) * [30.0, 10.0]
    surrogate = condition(evidence(u, outputs, np.zeros(2)))
    seen, expected = 0.0, 0.0
    for j, inverse in enumerate(surrogate.inverse_scales):
        r = np.exp(-0.5 * np.sum(((u[:, None] - u) * inverse) ** 2, axis=2)) + 1e-10 * np.eye(len(u))
        for i in range(len(u)):
            others = np.arange(len(u)) != i
            solved = np.linalg.solve(r[np.ix_(others, others)], r[others, i])
            rest = outputs[:, j] - surrogate.mean[j]
            seen += (rest[i] - solved @ rest[others]) ** 2 / surrogate.variance[j]
            expected += r[i, i] - solved @ r[others, i]
    assert seen / expected > 1.5
    factors = distrusted(surrogate).variance / surrogate.variance
    assert factors == pytest.approx(2.0 * seen / expected, rel=1e-3)


def test_distrust_never_makes_a_surrogate_surer(surrogate):
    assert np.all(distrusted(surrogate).variance >= 2.0 * surrogate.variance)
