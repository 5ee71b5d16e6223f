"""How far the estimated field may be trusted: the spread of the fields that explain the samples.

A model with derivatives is asked for the field of every draw. Of a dear one the fields of what was solved are
taken; their principal components, each a Gaussian process of the unknowns, give those of the draws. Where
it keeps its solves that costs nothing; else it is asked for as many fields as a quadratic has coefficients.

| symbol | meaning | shape |
|---|---|---|
| k | solves | |
| F | their fields, less the mean, (cells of the grid in one row) | (k, c) |
| A, V | F = A V: coefficients, components | (k, r), (r, c) |
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.domain import Grid
from fieldrl.estimator.problem import Compiled, Differentiable, ForwardModel
from fieldrl.estimator.surrogate.predictions import condition, evidence, predict_mean

_SOLVES = 60  # whose fields are looked at, the nearest; fewer where each has to be solved again
_LEFT = 1e-6  # share of the fields' variance that components may leave


def field_std(
    model: ForwardModel,
    estimate: NDArray[np.float64],
    theta: NDArray[np.float64],
    time: float,
    grid: Grid,
    solved: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Root mean square difference of the fields of draws from the estimated one.

    Args:
        model: the forward model.
        estimate: the estimated field, (nx, ny) [field unit].
        theta: draws of the unknowns, (m, p), see ``draws``.
        time: of the fields [time].
        grid: where.
        solved: parameters that were solved, (k, p), for a model without derivatives.

    Returns:
        (nx, ny) [field unit].
    """
    if isinstance(model, Compiled | Differentiable):
        square = np.zeros(estimate.shape)
        for one in theta:
            square += (model.field(one, time, grid) - estimate) ** 2
        return np.sqrt(square / len(theta))
    return _by_components(model, estimate, theta, time, grid, solved)


def _by_components(
    model: ForwardModel, estimate: NDArray, theta: NDArray, time: float, grid: Grid, solved: NDArray
) -> NDArray[np.float64]:
    """The same from the fields of what was solved."""
    centre, scale = model.parameters.centre, model.parameters.half_width
    u = (theta - centre) / scale
    solved = np.unique(solved, axis=0)
    near = solved[_nearest((solved - centre) / scale, u)]
    if not hasattr(model, "solutions"):
        p = len(model.parameters)
        near = near[_spread((near - centre) / scale, (p + 1) * (p + 2) // 2)]
    fields = np.array([model.field(one, time, grid).ravel() for one in near])
    mean = fields.mean(axis=0)
    coefficients, components = _principal(fields - mean)
    found = condition(evidence((near - centre) / scale, coefficients, np.zeros(len(components))))
    drawn = predict_mean(found, u)
    aside = mean - estimate.ravel()
    square = np.einsum("rc,rc->c", components, (drawn.T @ drawn / len(u)) @ components)
    square += aside**2 + 2.0 * aside * (drawn.mean(axis=0) @ components)
    return np.sqrt(np.maximum(square, 0.0)).reshape(estimate.shape)


def _nearest(inputs: NDArray, u: NDArray) -> NDArray[np.int64]:
    """Which of the solves are nearest to the draws' mean, in their standard deviations."""
    spread = u.std(axis=0) + 1e-3
    far = np.sum(((inputs - u.mean(axis=0)) / spread) ** 2, axis=1)
    return np.argsort(far, kind="stable")[:_SOLVES]


def _spread(inputs: NDArray, count: int) -> list[int]:
    """So many points far from each other, the first one of ``inputs`` (k, p) among them."""
    chosen = [0]
    far = np.linalg.norm(inputs - inputs[0], axis=1)
    while len(chosen) < count and far.max() > 0.0:
        chosen.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(inputs - inputs[chosen[-1]], axis=1))
    return chosen


def _principal(fields: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coefficients (k, r) and components (r, c) of fields whose mean is 0."""
    values, vectors = np.linalg.eigh(fields @ fields.T)
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    left = 1.0 - np.cumsum(values) / max(values.sum(), 1e-300)
    r = int(np.searchsorted(-left, -_LEFT)) + 1
    coefficients = vectors[:, :r] * np.sqrt(values[:r])
    components = (vectors[:, :r].T @ fields) / np.sqrt(np.maximum(values[:r], 1e-300))[:, None]
    return coefficients, components
