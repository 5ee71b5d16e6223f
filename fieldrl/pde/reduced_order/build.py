"""A reduced model from solves, and how far it is from solves that it has not seen.

Solves run in threads, for they release the interpreter. Linear algebra stays in one thread each, so that the
number of cores changes no bit.

| symbol | meaning | shape |
|---|---|---|
| u | scaled unknowns of solves | (s, p) |
| X | what they leave: cell averages, single precision | (s, k, cells) |
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl.core.streams import stream
from fieldrl.pde.reduced_order import kernel, modes, splines
from fieldrl.pde.reduced_order.nodes import Nodes
from fieldrl.pde.reduced_order.packing import Decomposed

Solve = Callable[[NDArray[np.float64]], NDArray[np.float32]]
"""u (p,) -> X (k, cells)."""

_In = TypeVar("_In")
_Out = TypeVar("_Out")


def threads() -> int:
    """As many as there are cores."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def together(work: Callable[[_In], _Out], items: Iterable[_In]) -> list[_Out]:
    """Work on all items, in as many threads as there are cores; the first error ends it."""
    pool = ThreadPoolExecutor(threads())
    try:
        with threadpool_limits(1):
            return list(pool.map(work, items))
    finally:
        pool.shutdown(cancel_futures=True)


def solved(solve: Solve, u: NDArray[np.float64]) -> NDArray[np.float32]:
    """X at u (s, p)."""
    first = solve(u[0])
    found = np.empty((len(u), *first.shape), dtype=np.float32)
    found[0] = first

    def one(number: int) -> None:
        found[number] = solve(u[number])

    together(one, range(1, len(u)))
    return found


def decomposed(
    found: NDArray[np.float32],
    nodes: Nodes,
    axes: Sequence[splines.Axis],
    times: Sequence[float],
    left_out: float,
) -> list[Decomposed]:
    """Modes and coefficients at each time, of the solves at ``nodes``.

    Args:
        found: X at ``nodes.points``.
        nodes: where the solves are.
        axes: of the tensor grid that the lines fill.
        times: of the snapshots, (k,).
        left_out: see ``modes`` [field unit].
    """

    def one(number: int) -> Decomposed:
        amplitudes, fields = modes.modes(found[:, number], left_out)
        return Decomposed(times[number], fields, splines.coefficients(axes, on_grid(amplitudes, nodes)))

    return together(one, range(len(times)))


def on_grid(values: NDArray[np.float64], nodes: Nodes) -> NDArray[np.float64]:
    """Values at ``nodes.points`` (s, r), by a spline along each line at all nodes, (N_1, ..., N_p, r)."""
    ends = np.cumsum([len(line.nodes) for line in nodes.lines])[:-1]
    target = nodes.axes[nodes.along]
    lines = [
        splines.resampled(line.nodes, part, target)
        for line, part in zip(nodes.lines, np.split(values, ends), strict=True)
    ]
    others = [len(one) for k, one in enumerate(nodes.axes) if k != nodes.along]
    return np.moveaxis(np.reshape(lines, (*others, len(target), values.shape[1])), -2, nodes.along)


def fresh(count: int, p: int, seed: int) -> NDArray[np.float64]:
    """Scaled unknowns of solves to compare with, uniform within the bounds, (count, p)."""
    return stream(seed, "held out").uniform(-1, 1, (count, p))


def errors(
    constants: NDArray[np.float64], solve: Solve, count: int, parameters: Any, seed: int = 0
) -> NDArray[np.float64]:
    """Root mean square over the cells of prediction - fresh solve, at each time, (count, k) [field unit].

    Args:
        constants: the model, see ``packing``.
        solve: a full solve.
        count: how many, drawn uniformly within the bounds.
        parameters: the unknowns.
        seed: of the draw.
    """
    u = fresh(count, len(parameters), seed)

    def one(at: NDArray[np.float64]) -> NDArray[np.float64]:
        theta, exact = parameters.centre + parameters.half_width * at, solve(at)
        found = np.array([kernel.state(theta, which, constants) for which in range(len(exact))])
        return np.sqrt(np.mean((found - exact) ** 2, axis=1))

    return np.array(together(one, u))
