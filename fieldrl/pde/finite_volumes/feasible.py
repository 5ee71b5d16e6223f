"""Whether solves on a grid are feasible: that the flow can be followed, and what a solve takes.

Times are those of one core of an ordinary machine of 2025; see ``python -m pipelines.benchmarks.estimates``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fieldrl.core import checks
from fieldrl.core.cost import DOUBLE, Cost, Extent
from fieldrl.pde.finite_volumes.discretisation import MOST_SUBSTEPS, Discretisation

MOST_CELLS = 4_000_000  # of the true field's grid: some 15 GB of working arrays
_FEWEST_CELLS = 9  # what sampling between cells needs
_WORKING = 450  # numbers for each cell while a solve is computed
_CELL, _SUBSTEP = 3.5e-8, 6e-5  # time of a cell in a substep, and of the substep itself [s]
_SMALL_COURANT = 0.1
_SOLVES = 5  # for each sample, typically


def checked_cells(value: Any, refinement: int) -> tuple[int, int]:
    """(nx, ny); raises InvalidValue where they are too few, or too many once they are refined."""
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray) or len(value) != 2:
        raise checks.InvalidValue("cells", value, "must be [nx, ny]")
    nx, ny = (checks.integer("cells", n, _FEWEST_CELLS) for n in value)
    if nx * ny * refinement**2 > MOST_CELLS:
        rule = f"the true field, truth_refinement={refinement} times finer, has more than {MOST_CELLS} cells"
        raise checks.InvalidValue("cells", value, rule, remedy="a coarser grid, or truth_refinement=1")
    return nx, ny


def checked_bounds(
    scheme: Discretisation, lower: Sequence[float], upper: Sequence[float], final_time: float
) -> int:
    """The most substeps that any flow within the bounds needs; refuses bounds with one it cannot follow.

    Args:
        scheme: the discretisation.
        lower: bounds of the flow's parameters, (p,).
        upper: the same.
        final_time: how far a solve reaches [time].
    """
    times, most = np.linspace(0.0, final_time, 9), 0
    for corner in itertools.product(*zip(lower, upper, strict=True)):
        with np.errstate(all="ignore"):
            psi = scheme.streamfunction(np.array(corner), times)
            followed = scheme.follows(psi)
            most = max(most, scheme.substeps(psi, final_time))
        if not followed:
            rule = f"the bounds hold a flow that the grid cannot follow stably, theta={list(corner)}"
            remedy = f"narrow the bounds or refine the grid, cells={list(scheme.cells)}"
            raise checks.InvalidValue("upper", upper, rule, remedy=remedy)
        if most > MOST_SUBSTEPS:
            raise _too_many(scheme, most, scheme.substeps(np.zeros_like(psi), final_time), final_time, upper)
    return most


def _too_many(
    scheme: Discretisation, needed: int, still: int, final_time: float, upper: Sequence[float]
) -> checks.InvalidValue:
    """The setting to blame: the step's share of its limit, what spreads even in still water, or the flow."""
    steps = f"a solve would take more than {MOST_SUBSTEPS} steps"
    remedy = f"fewer cells={list(scheme.cells)}, or a shorter final_time={final_time:g}"
    if scheme.courant < _SMALL_COURANT and needed * scheme.courant <= MOST_SUBSTEPS:
        return checks.InvalidValue("courant", scheme.courant, steps, remedy="a larger share of the limit")
    if still > MOST_SUBSTEPS:
        return checks.InvalidValue(
            "diffusivity", scheme.diffusivity, steps, remedy=f"a smaller one, {remedy}"
        )
    return checks.InvalidValue(
        "upper", upper, f"{steps} in the fastest flow", remedy=f"narrow the bounds, {remedy}"
    )


def solve_bytes(cells: Sequence[int], snapshots: int) -> float:
    """Memory of one solve that is kept [bytes]."""
    return DOUBLE * snapshots * math.prod(cells)


def solve_seconds(scheme: Discretisation, substeps: int) -> float:
    """Time of one solve [s]."""
    return substeps * (_SUBSTEP + _CELL * math.prod(scheme.cells) * (1 + scheme.positive))


def cost(extent: Extent, cells: Sequence[int], snapshots: int, refinement: int, seconds: float, limit: float):
    """The true field's solve on the finer grid, working arrays and stored solves.

    Args:
        extent: what is done.
        cells: of the model.
        snapshots: states that a solve leaves.
        refinement: how many times finer the true field's grid is.
        seconds: time of one of the model's solves [s].
        limit: of the store of solves [bytes].
    """
    one = solve_bytes(cells, snapshots)
    truth = refinement**2 * one
    working = DOUBLE * _WORKING * refinement**2 * math.prod(cells) + truth
    kept = min(limit, truth + _SOLVES * extent.samples * one)
    again = 1 if truth <= limit else extent.samples  # what cannot be kept is solved for every sample
    by = ("cells", "truth_refinement", "final_time", "interval", "solutions.memory")
    return Cost(working + kept, again * refinement**4 * seconds, by)
