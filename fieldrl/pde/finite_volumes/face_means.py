"""Flows without streamfunction on the solver's grid: mean velocities of the faces.

| symbol | meaning | shape | unit |
|---|---|---|---|
| U | mean velocity through faces normal to x | (nx + 1, ny) | length/time |
| V | mean velocity through faces normal to y | (nx, ny + 1) | length/time |
| psi_x | running sums of -U hy along y | (k, nx + 1, ny + 1) | length^2/time |
| psi_y | running sums of V hx along x | (k, nx + 1, ny + 1) | length^2/time |

Means are taken by four Gauss points. What a face lets through is a difference of psi_x or psi_y, as with a
streamfunction; but the two are different, and the flow may have a divergence.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_NODES, _MEAN = np.array(np.polynomial.legendre.leggauss(4)) * [[1.0], [0.5]]
_CLOSED = 1e-10  # of the greatest velocity: a wall that lets no more through is closed


def running_sums(flow: Any, theta: NDArray, x: NDArray, y: NDArray, times: NDArray) -> NDArray[np.float64]:
    """psi_x and psi_y at times (k,), (k, 2, nx + 1, ny + 1).

    Args:
        flow: has ``velocity(theta, positions, time)``.
        theta: (p,).
        x: edges of the cells, (nx + 1,) [length].
        y: the same, (ny + 1,) [length].
        times: (k,) [time].
    """
    sums = np.zeros((len(times), 2, len(x), len(y)))
    through_x, through_y = _points(x, _inner(y)), _points(_inner(x), y)
    for level, time in zip(sums, times, strict=True):
        u = flow.velocity(theta, through_x, time)[:, 0].reshape(len(x), -1, len(_NODES)) @ _MEAN
        along = flow.velocity(theta, through_y, time)[:, 1].reshape(-1, len(_NODES), len(y))
        v = np.einsum("igj,g->ij", along, _MEAN)
        _close_walls(u, v)
        np.cumsum(-u * np.diff(y), axis=1, out=level[0, :, 1:])
        np.cumsum(v * np.diff(x)[:, None], axis=0, out=level[1, 1:])
    return sums


def shrinking(psi: NDArray[np.float64], area: float) -> float:
    """The greatest rate at which water runs together in a cell, max(-div v), at least 0 [1/time].

    Args:
        psi: psi_x and psi_y, (k, 2, nx + 1, ny + 1).
        area: of a cell [length^2].
    """
    out_x = -np.diff(np.diff(psi[:, 0], axis=2), axis=1)
    out_y = np.diff(np.diff(psi[:, 1], axis=1), axis=2)
    return max(0.0, float(-(out_x + out_y).min() / area))


def _inner(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gauss's points between the edges, (4 n,)."""
    return (0.5 * (edges[1:] + edges[:-1])[:, None] + 0.5 * np.diff(edges)[:, None] * _NODES).ravel()


def _points(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)


def _close_walls(u: NDArray[np.float64], v: NDArray[np.float64]) -> None:
    """Let nothing through a wall that is closed but for rounding, in place."""
    fastest = max(np.abs(u).max(), np.abs(v).max())
    for wall in (u[0], u[-1], v[:, 0], v[:, -1]):
        if np.abs(wall).max() <= _CLOSED * fastest:
            wall[:] = 0.0
