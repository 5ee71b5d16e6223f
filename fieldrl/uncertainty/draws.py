"""Unknowns that explain the samples, each as often as it is likely: for what follows from them, as the field.

Importance sampling without chance: points about every solution and points that cover the box, weighted by
likelihood over the density that they were taken with; then each is taken as often as its weight says. Within
the bounds nothing is more likely than anything else before there are samples.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns (theta - theta0) / s | (m, p) |
| q | density of the points | (m,) |
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, ndtri

from fieldrl.estimator.designs import cover
from fieldrl.uncertainty.assessment import Assessment

COUNT = 100
"""Draws, where nothing else is said."""

_BOX, _ABOUT = 9, 8  # two to these: points that cover the box, points about each solution
_MOST = 8  # solutions
_WIDER = 1.5  # than the normal likelihood at a solution: the points about it
_PRIOR = 3.0  # information of the bounds alone


def draws(assessed: Assessment, count: int = COUNT) -> NDArray[np.float64]:
    """Points u that explain the samples, as often as they are likely, (count, p) [half-width]."""
    u, density = _points(assessed)
    inside = np.abs(u).max(axis=1) <= 1.0
    u, density = u[inside], density[inside]
    weight = assessed.log_likelihood(u) - density
    cumulated = np.cumsum(np.exp(weight - logsumexp(weight)))
    at = np.searchsorted(cumulated, (np.arange(count) + 0.5) / count * cumulated[-1])
    return u[at]


def _points(assessed: Assessment) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (m, p), and the log of their density, (m,)."""
    parameters, p = assessed.parameters, len(assessed.parameters)
    centres = (assessed.solutions[:_MOST] - parameters.centre) / parameters.half_width
    normal = ndtri((cover(_ABOUT, p) + 1.0) / 2.0)
    _, slopes = assessed.deviance.linearise(centres)
    roots = [_root(each, assessed.variance) for each in slopes]
    points = [cover(_BOX, p), *(u + normal @ root.T for u, root in zip(centres, roots, strict=True))]
    u = np.concatenate(points)
    parts = [np.full(len(u), _BOX * np.log(2.0) - p * np.log(2.0))]
    for centre, root in zip(centres, roots, strict=True):
        off = np.linalg.solve(root, (u - centre).T)
        log_size = np.log(np.abs(np.diag(root))).sum() + 0.5 * p * np.log(2.0 * np.pi)
        parts.append(_ABOUT * np.log(2.0) - 0.5 * np.sum(off**2, axis=0) - log_size)
    return u, logsumexp(parts, axis=0)


def _root(slopes: NDArray, variance: float) -> NDArray[np.float64]:
    """Cholesky factor of the covariance of the points about a solution, (p, p), from J (n, p)."""
    information = slopes.T @ slopes / variance + _PRIOR * np.eye(slopes.shape[1])
    return np.asarray(_WIDER * np.linalg.cholesky(np.linalg.inv(information)), dtype=np.float64)
