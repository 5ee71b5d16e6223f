"""The advection equation with a constant flow, in closed form (Eq. 1-2).

f(x, t) = h(x - t b) + integral over s from 0 to t of g(x + (s - t) b, s)

| symbol | meaning | shape | unit |
|---|---|---|---|
| b | flow, the unknown theta | (2,) | length/time |
| h | initial feature, Eq. (26) | | field unit |
| g | source, Duhamel's integral | | field unit/time |
| x, t | positions and times | (n, 2), (n,) | length, time |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import carray, cfunc, njit  # pyright: ignore[reportPrivateImportUsage]
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.compiled import MODEL
from fieldrl.core.domain import Domain, Grid
from fieldrl.core.parameters import Parameters
from fieldrl.pde.flow import UniformFlow
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.source import LocalisedSource

_SOURCE, _NODES = 5, 11  # where source and quadrature begin in the constants, after the feature
_REACH = 6.5  # widths beyond which a Gaussian source is below 1e-18 of its strength


@dataclass(frozen=True)
class Advection:
    """A feature carried by an unknown constant flow b; a forward model with p = 2.

    Args:
        initial: h(x).
        source: g(x, t), or None.
        true: the flow that carries the true field (b_x, b_y) [length/time].
        lower: lower bounds of b [length/time].
        upper: upper bounds of b [length/time].
        domain: where the vehicle may go; the field itself is defined on the whole plane.
        quadrature: Gauss-Legendre nodes of Duhamel's integral.
    """

    initial: InitialFeature = field(default_factory=InitialFeature)
    source: LocalisedSource | None = None
    true: Sequence[float] = (5.0, 5.0)
    lower: Sequence[float] = (-15.0, -15.0)
    upper: Sequence[float] = (15.0, 15.0)
    domain: Domain = field(default_factory=Domain)
    quadrature: int = 48

    def __post_init__(self) -> None:
        for name in ("true", "lower", "upper"):
            object.__setattr__(self, name, checks.vector(name, getattr(self, name), 2, "length/time"))
        checks.ordered_bounds(self.lower, self.upper, self.true, "length/time")
        checks.integer("quadrature", self.quadrature, 2)

    @cached_property
    def flow(self) -> UniformFlow:
        """The flow that carries the feature and the vehicle."""
        return UniformFlow()

    @cached_property
    def parameters(self) -> Parameters:
        """b_x and b_y."""
        units = ("length/time", "length/time")
        return Parameters(("b_x", "b_y"), units, tuple(self.lower), tuple(self.upper), tuple(self.true))

    @property
    def horizon(self) -> float:
        """The closed form holds for ever [time]."""
        return math.inf

    @cached_property
    def grid(self) -> Grid:
        """Where the field is recorded: about 100 cells along the domain's longer side."""
        (x0, y0), (x1, y1) = self.domain.lower, self.domain.upper
        cell = max(x1 - x0, y1 - y0) / 100
        return self.domain.grid(max(1, round((x1 - x0) / cell)), max(1, round((y1 - y0) / cell)))

    @property
    def kernel(self) -> int:
        """Address of the compiled MODEL function."""
        return int(_model.address or 0)

    @cached_property
    def constants(self) -> NDArray[np.float64]:
        """Feature, source and quadrature, as the compiled function reads them."""
        source = np.zeros(6) if self.source is None else self.source.constants
        nodes, weights = np.polynomial.legendre.leggauss(self.quadrature)
        return np.concatenate([self.initial.constants, source, [self.quadrature], nodes, weights])

    def truth(self) -> Advection:
        """The model that generates the true field: this one, for it is exact."""
        return self

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """Eq. (2) for m candidates at n samples.

        Args:
            theta: candidates b, (m, 2) [length/time].
            positions: (n, 2) [length].
            times: (n,), >= 0 [time].

        Returns:
            (m, n) [field unit].
        """
        return self._evaluate(theta, positions, times)[0]

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """Derivatives of ``predict`` with respect to b, (m, n, 2) [field unit time/length]."""
        return self._evaluate(theta, positions, times)[1]

    def field(self, theta: NDArray, time: float, grid: Grid) -> NDArray[np.float64]:
        """f(., time) at the centres of ``grid``, (nx, ny) [field unit]."""
        points = grid.points
        values = self.predict(np.asarray(theta)[None], points, np.full(len(points), float(time)))
        return values.reshape(grid.x.size, grid.y.size)

    def _evaluate(self, theta: NDArray, positions: NDArray, times: NDArray) -> tuple[NDArray, NDArray]:
        theta = np.ascontiguousarray(theta, dtype=float)
        positions = np.ascontiguousarray(positions, dtype=float)
        times = np.ascontiguousarray(times, dtype=float)
        return _evaluate(theta, positions, times, self.constants)


@njit(cache=True, error_model="numpy")
def _evaluate(theta, positions, times, constants):
    m, n = theta.shape[0], times.size
    prediction, jacobian = np.empty((m, n)), np.empty((m, n, 2))
    _advect(theta, positions, times, constants, prediction, jacobian)
    return prediction, jacobian


@njit(cache=True, error_model="numpy")
def _advect(theta, positions, times, constants, prediction, jacobian):
    """Eq. (2) and its gradient for m candidates at n samples, in place, (m, n) and (m, n, 2)."""
    a, cx, cy, scale, q = constants[0], constants[1], constants[2], constants[3], constants[4]
    shrink = 1.0 / scale
    for m in range(theta.shape[0]):
        bx, by = theta[m, 0], theta[m, 1]
        for i in range(times.size):
            t = times[i]
            x, y = positions[i, 0] - t * bx, positions[i, 1] - t * by
            dx, dy = (x - cx) * shrink, (y - cy) * shrink
            if q == 2.0:
                h = a * math.exp(-(dx * dx + dy * dy))
                slope_x, slope_y = 2.0 * dx, 2.0 * dy
            else:
                h = a * math.exp(-(abs(dx) ** q + abs(dy) ** q))
                slope_x, slope_y = _slope(dx, q), _slope(dy, q)
            prediction[m, i] = h
            jacobian[m, i, 0] = t * shrink * slope_x * h
            jacobian[m, i, 1] = t * shrink * slope_y * h
            if constants[_SOURCE] != 0.0:
                f, fx, fy = _duhamel(x, y, t, bx, by, constants)
                prediction[m, i] += f
                jacobian[m, i, 0] += fx
                jacobian[m, i, 1] += fy


@njit(cache=True, error_model="numpy")
def _slope(d, q):
    """Derivative of |d|^q; 0 at the crease of q = 1."""
    return q * np.sign(d) * abs(d) ** (q - 1.0)


@njit(cache=True, error_model="numpy")
def _duhamel(x, y, t, bx, by, constants):
    """Duhamel's integral along the characteristic through (x, y) at time 0, and its derivatives by b.

    The integrand is a Gaussian in s; the nodes are spread where it is not negligible.
    """
    dx, dy, width = x - constants[_SOURCE + 1], y - constants[_SOURCE + 2], constants[_SOURCE + 3]
    begin, end = constants[_SOURCE + 4], min(t, constants[_SOURCE + 5])
    speed2 = bx * bx + by * by
    if speed2 > 0.0:
        nearest, reach = -(dx * bx + dy * by) / speed2, _REACH * width / math.sqrt(speed2)
        begin, end = max(begin, nearest - reach), min(end, nearest + reach)
    f, fx, fy = 0.0, 0.0, 0.0
    if end <= begin:
        return f, fx, fy
    count = int(constants[_NODES])
    for k in range(count):
        s = 0.5 * (begin + end) + 0.5 * (end - begin) * constants[_NODES + 1 + k]
        ux, uy = (dx + s * bx) / width, (dy + s * by) / width
        rate = constants[_NODES + 1 + count + k] * math.exp(-(ux * ux + uy * uy))
        f += rate
        fx -= 2.0 * rate * ux * (s - t) / width
        fy -= 2.0 * rate * uy * (s - t) / width
    half = 0.5 * (end - begin) * constants[_SOURCE]
    return half * f, half * fx, half * fy


@cfunc(MODEL, cache=True)
def _model(theta, m, positions, times, n, constants, prediction, jacobian):
    _advect(
        carray(theta, (m, 2)),
        carray(positions, (n, 2)),
        carray(times, (n,)),
        carray(constants, (_NODES + 1 + 2 * int(constants[_NODES]),)),
        carray(prediction, (m, n)),
        carray(jacobian, (m, n, 2)),
    )
