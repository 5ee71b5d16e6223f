"""Where the flow carries a particle: the place of the feature at a later time, to the order of its size."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from fieldrl.core.compiled import call_flow
from fieldrl.core.flow_adapter import adapted

_SUBSTEPS = 64


def carried(flow: Any, theta: ArrayLike, place: ArrayLike, time: float) -> NDArray[np.float64]:
    """The place at ``time`` of the particle that is at ``place`` at time 0, by classical Runge-Kutta.

    Args:
        flow: any.
        theta: its parameters, (p,).
        place: (2,) [length].
        time: >= 0 [time].

    Returns:
        (2,) [length].
    """
    flow, theta = adapted(flow), np.ascontiguousarray(theta, dtype=float)
    place = np.array(place, dtype=float)
    return _carried(flow.kernel, flow.constants, theta, place, float(time), _SUBSTEPS)


def predicted_place(model: Any, theta: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Where the flow at theta (p,) has carried the centre of the initial feature, (2,) [length]."""
    own = model.flow_parameters(theta) if hasattr(model, "flow_parameters") else theta
    return carried(model.flow, own, model.initial.centre, time)


def carried_many(
    flow: Any, thetas: NDArray[np.float64], places: NDArray[np.float64], time: float
) -> NDArray[np.float64]:
    """``carried`` for B places (B, 2), each with flow parameters of its own, (B, p): (B, 2) [length]."""
    flow, found = adapted(flow), np.array(places, dtype=float)
    _carry_all(flow.kernel, flow.constants, np.ascontiguousarray(thetas), found, float(time), _SUBSTEPS)
    return found


@njit(cache=True)
def _carry_all(kernel, constants, thetas, places, time, substeps):
    for b in range(len(places)):
        _carried(kernel, constants, thetas[b], places[b], time, substeps)


@njit(cache=True)
def _carried(kernel, constants, theta, place, time, substeps):
    k = np.empty((4, 2))
    h, t = time / substeps, 0.0
    for _ in range(substeps):
        x, y = place
        call_flow(kernel, theta.ctypes, constants.ctypes, x, y, t, k[0].ctypes)
        for stage, share in enumerate((0.0, 0.5, 0.5, 1.0)):
            at_x, at_y = x, y
            if stage > 0:
                at_x += share * h * k[stage - 1, 0]
                at_y += share * h * k[stage - 1, 1]
            call_flow(kernel, theta.ctypes, constants.ctypes, at_x, at_y, t + share * h, k[stage].ctypes)
        for i in range(2):
            place[i] += h / 6 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
        t += h
    return place
