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
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property, lru_cache
from typing import Annotated, Any

import numpy as np
from numba import carray, cfunc, njit  # pyright: ignore[reportPrivateImportUsage]
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.compiled import MODEL, loop
from fieldrl.core.domain import Domain, Grid
from fieldrl.core.exponential import exponential, exponentials
from fieldrl.core.kinds import OR_NULL, component
from fieldrl.core.parameters import Parameters
from fieldrl.pde.flow import UniformFlow
from fieldrl.pde.initial import InitialFeature, check_visible
from fieldrl.pde.source import LocalisedSource
from fieldrl.pde.truth import differing
from fieldrl.pde.unknowns import Scalar, Unknowns, check_sides, check_truth, unknowns

_MAY_DIFFER = ("initial", "source", "quadrature")
_SOURCE, _NODES = 5, 11  # where source and quadrature begin in the constants, after the feature
_FEATURE = ("amplitude", "centre", "", "scale", "exponent")  # in the order of their constants
_SOURCE_FIELDS = ("strength", "centre", "", "width", "opens", "closes")
_MOST_NODES = 1000  # finding them takes a second, and none of them is felt
_TERM = 2e-8  # time of an exponential and its derivatives [s]
_REACH = 6.5  # widths beyond which a Gaussian source is below 1e-18 of its strength


@component
class Advection:
    """A feature carried by a constant flow b; a forward model.

    Args:
        initial: h(x).
        source: g(x, t), or None.
        true: the flow that carries the true field (b_x, b_y), null where nobody knows it [length/time].
        lower: lower bounds of b [length/time].
        upper: upper bounds of b [length/time].
        domain: where the vehicle may go; the field itself is defined on the whole plane.
        quadrature: Gauss-Legendre nodes of Duhamel's integral.
        true_model: what differs in the model that generates the true field, see ``truth.differing``; None:
            nothing.
        unknown: what is unknown, {name: {true, lower, upper}}, see ``unknowns``; None: b.
    """

    initial: InitialFeature = field(default_factory=InitialFeature)
    source: LocalisedSource | None = None
    true: Annotated[Sequence[float | None], OR_NULL] = (5.0, 5.0)
    lower: Sequence[float] = (-15.0, -15.0)
    upper: Sequence[float] = (15.0, 15.0)
    domain: Domain = field(default_factory=Domain)
    quadrature: int = 48
    true_model: Mapping[str, Any] | None = None
    unknown: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "true", checks.truth("true", self.true, 2, "length/time"))
        for name in ("lower", "upper"):
            object.__setattr__(self, name, checks.vector(name, getattr(self, name), 2, "length/time"))
        checks.ordered_bounds(self.lower, self.upper, self.true, "length/time")
        if checks.integer("quadrature", self.quadrature, 2) > _MOST_NODES:
            raise checks.InvalidValue("quadrature", self.quadrature, f"must be <= {_MOST_NODES}")
        check_sides(self._unknowns)
        check_visible(self.initial, self.source, self.parameters.names)
        self._check_truth()

    def _check_truth(self) -> None:
        """Builds the true field's model, which refuses what is impossible."""
        check_truth(self._unknowns, self.truth()._unknowns)

    @cached_property
    def flow(self) -> UniformFlow:
        """The flow that carries the feature and the vehicle."""
        return UniformFlow()

    @cached_property
    def _unknowns(self) -> Unknowns:
        bounds = self.true, self.lower, self.upper
        return unknowns(self.unknown, self.flow, bounds, {}, source=self.source, initial=self.initial)

    @property
    def parameters(self) -> Parameters:
        """b_x and b_y, or what is named in ``unknown``."""
        return self._unknowns.parameters

    def flow_parameters(self, theta: NDArray) -> NDArray[np.float64]:
        """b at theta (p,), (2,) [length/time]."""
        return self._unknowns.flow_parameters(theta)

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
        return int((_model if self.unknown is None else _with_unknowns().kernel).address or 0)

    @cached_property
    def constants(self) -> NDArray[np.float64]:
        """Feature, source and quadrature, as the compiled function reads them."""
        source = np.zeros(6) if self.source is None else self.source.constants
        nodes, weights = _quadrature(self.quadrature)
        rest = [self.quadrature], nodes, weights
        if self.unknown is None:
            return np.concatenate([self.initial.constants, source, *rest])
        scalars = self._unknowns.scalars
        places = [len(scalars), *map(_number, scalars), self.source is not None]
        flow = np.nan_to_num(self._unknowns.flow)
        return np.concatenate([flow, self.initial.constants, source, places, *rest])

    def solve_seconds(self, samples: int) -> float:
        """Time to predict one candidate at so many samples [s]."""
        return samples * _TERM * (1 if self.source is None else self.quadrature)

    def truth(self) -> Advection:
        """The model that generates the true field: this one, for it is exact, but for ``true_model``."""
        if self.true_model is None:
            return self
        return differing(self, self.true_model, _MAY_DIFFER, true_model=None)

    def admissible(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The positions (n, 2) themselves: the field is defined on the whole plane [length]."""
        return positions

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """Eq. (2) for m candidates at n samples.

        Args:
            theta: candidates, (m, p).
            positions: (n, 2) [length].
            times: (n,), >= 0 [time].

        Returns:
            (m, n) [field unit].
        """
        return self._evaluate(theta, positions, times)[0]

    def jacobian(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """Derivatives of ``predict`` by the unknowns, (m, n, p) [field unit / unit of each]."""
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
        evaluate = _evaluate if self.unknown is None else _with_unknowns().evaluate
        return evaluate(theta, positions, times, self.constants)


def _with_unknowns() -> Any:
    """The loops for unknowns of one's choice: loading them takes a while, and few runs need them."""
    from fieldrl.pde import advection_unknowns

    return advection_unknowns


@lru_cache(maxsize=64)
def _quadrature(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes and weights of Gauss-Legendre quadrature on (-1, 1), each (count,); finding them takes long."""
    return np.polynomial.legendre.leggauss(count)


def _number(scalar: Scalar) -> int:
    """The number of a scalar in ``advection_unknowns``."""
    if scalar.part == "flow":
        return int(scalar.field)
    fields, first = (_FEATURE, 2) if scalar.part == "initial" else (_SOURCE_FIELDS, 7)
    return first + fields.index(str(scalar.field)) + (scalar.place or 0)


@njit(cache=True, error_model="numpy")
def _evaluate(theta, positions, times, constants):
    m, n = theta.shape[0], times.size
    prediction, jacobian = np.empty((m, n)), np.empty((m, n, 2))
    _advect(theta, positions, times, constants, prediction, jacobian)
    return prediction, jacobian


@loop
def _advect(theta, positions, times, constants, prediction, jacobian):
    """Eq. (2) and its gradient for m candidates at n samples, in place, (m, n) and (m, n, 2)."""
    if constants[4] == 2.0:
        _advect_feature(theta, positions, times, constants, True, prediction, jacobian)
    else:
        _advect_feature(theta, positions, times, constants, False, prediction, jacobian)
    if constants[_SOURCE] != 0.0:
        _add_source(theta, positions, times, constants, prediction, jacobian)


@loop
def _advect_feature(theta, positions, times, constants, gaussian, prediction, jacobian):
    """``_advect`` without source; what is ``gaussian`` needs no powers."""
    feature = constants[0], constants[1], constants[2], 1.0 / constants[3], constants[4]
    if times.size == 1:
        _at_one_sample(theta, positions, times, feature, gaussian, prediction, jacobian)
        return
    for m in range(theta.shape[0]):
        bx, by = theta[m, 0], theta[m, 1]
        for i in range(times.size):
            x, y, t = positions[i, 0], positions[i, 1], times[i]
            decay = exponential(_exponent(x, y, t, bx, by, feature, gaussian))
            found = _feature(x, y, t, bx, by, feature, gaussian, decay)
            prediction[m, i], jacobian[m, i, 0], jacobian[m, i, 1] = found


@loop
def _at_one_sample(theta, positions, times, feature, gaussian, prediction, jacobian):
    """``_advect_feature`` for n = 1: flat arrays, so that LLVM takes several candidates at a time."""
    b, values, slopes = theta.reshape(-1), prediction.reshape(-1), jacobian.reshape(-1)
    x, y, t = positions[0, 0], positions[0, 1], times[0]
    for m in range(values.size):
        values[m] = _exponent(x, y, t, b[2 * m], b[2 * m + 1], feature, gaussian)
    exponentials(values, values)
    for m in range(values.size):
        found = _feature(x, y, t, b[2 * m], b[2 * m + 1], feature, gaussian, values[m])
        values[m], slopes[2 * m], slopes[2 * m + 1] = found


@loop
def _exponent(x, y, t, bx, by, feature, gaussian):
    """The exponent of Eq. (26) at (x, y, t)."""
    _, cx, cy, shrink, q = feature
    dx, dy = (x - t * bx - cx) * shrink, (y - t * by - cy) * shrink
    return -(dx * dx + dy * dy) if gaussian else -(abs(dx) ** q + abs(dy) ** q)


@loop
def _feature(x, y, t, bx, by, feature, gaussian, decay):
    """Eq. (26) and its derivatives by b, where the exponential in it is ``decay``."""
    a, cx, cy, shrink, q = feature
    dx, dy = (x - t * bx - cx) * shrink, (y - t * by - cy) * shrink
    h = a * decay
    slope_x, slope_y = (2.0 * dx, 2.0 * dy) if gaussian else (_slope(dx, q), _slope(dy, q))
    return h, t * shrink * slope_x * h, t * shrink * slope_y * h


@njit(cache=True, error_model="numpy")
def _add_source(theta, positions, times, constants, prediction, jacobian):
    """Duhamel's integral and its derivatives, added in place."""
    for m in range(theta.shape[0]):
        bx, by = theta[m, 0], theta[m, 1]
        for i in range(times.size):
            t = times[i]
            x, y = positions[i, 0] - t * bx, positions[i, 1] - t * by
            f, fx, fy = _duhamel(x, y, t, bx, by, constants)
            prediction[m, i] += f
            jacobian[m, i, 0] += fx
            jacobian[m, i, 1] += fy


@loop
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
