"""How far a time step may reach, and what flow it uses.

The semi-discrete equation dc/dt = L(t) c + g(t) is linear. A step of length H is a commutator-free Magnus
step of order 4 (Blanes & Moan, 2006): two substeps of H / 2, each with a flow that is frozen at a weighted
mean of the flows at the two Gauss nodes. Within a substep the exponential is a polynomial of degree 6,

    R(z) = 1 + z + z^2/2! + z^3/3! + z^4/4! + 0.6716 z^5/5! + 0.589 z^6/6!

exact to order 4; its last two terms were chosen for the longest stable substep with upwind stencils: 0.45
cells per evaluation of L against 0.40 for the classical Runge-Kutta method (order 9). Nested, each stage is
base + fraction * L(last stage): nothing is accumulated, and only a streamfunction enters, so the flow stays
divergence-free within a substep.

| symbol | meaning | unit |
|---|---|---|
| H | step, two substeps | time |
| S = max(abs u / hx + abs v / hy) | cells crossed per time | 1/time |
| Q = rho (1/hx^2 + 1/hy^2) | rate of diffusion | 1/time |
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

_COEFFICIENTS = (1.0, 1.0, 1 / 2, 1 / 6, 1 / 24, 0.6716 / 120, 0.589 / 720)
CHAIN = tuple(high / low for low, high in zip(_COEFFICIENTS[-2::-1], _COEFFICIENTS[:0:-1], strict=True))
ADVECTION_LIMIT = {3: 2.38, 5: 2.61, 7: 2.69, 9: 2.70}  # S * substep, from the symbols of the stencils
DIFFUSION_LIMIT = {3: 0.61, 5: 0.55, 7: 0.51, 9: 0.48}  # Q * substep
_NODES = (0.5 - math.sqrt(3) / 6, 0.5 + math.sqrt(3) / 6)
_OWN, _OTHER = 2 * (3 + 2 * math.sqrt(3)) / 12, 2 * (3 - 2 * math.sqrt(3)) / 12

Levels = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def substep_rate(order: int, advection: float, diffusion: float) -> float:
    """Least number of substeps per time [1/time] for S and Q [1/time]; any mix of the two is stable."""
    return advection / ADVECTION_LIMIT[order] + diffusion / DIFFUSION_LIMIT[order]


def steps_for(span: float, rate: float) -> int:
    """Whole steps (pairs of substeps) that cover ``span`` [time] at ``rate`` substeps per time."""
    return max(1, math.ceil(span * rate / 2 - 1e-9))


def frozen(levels: Levels, start: float, span: float, steps: int) -> NDArray[np.float64]:
    """What each substep holds fixed: a weighted mean of levels(times) (k, ...), (2 steps, ...).

    Args:
        levels: a quantity at times (k,), e.g. the streamfunction.
        start: beginning of the span [time].
        span: its length [time].
        steps: how many steps share it.
    """
    length = span / steps
    begins = start + length * np.arange(steps)[:, None]
    values = levels((begins + length * np.array(_NODES)).ravel())
    pairs = values.reshape(steps, 2, *values.shape[1:])
    mixed = _OWN * pairs
    mixed += _OTHER * pairs[:, ::-1]
    return mixed.reshape(values.shape)


def stages(levels: Levels, start: float, span: float, steps: int) -> NDArray[np.float64]:
    """levels at t, t + H, t + H / 2 of each step, the stages of the limited scheme, (3 steps, ...)."""
    length = span / steps
    begins = start + length * np.arange(steps)[:, None]
    return levels((begins + length * np.array([0.0, 1.0, 0.5])).ravel())
