"""The advection-diffusion equation with an unknown flow, solved numerically, Eq. (29).

    dc/dt + div(v c) = rho lap c + g,    dc/dn = 0 on the walls,    c(x, 0) = h(x)

One solve answers every question about a theta: it leaves cell averages at equal intervals up to the final
time, from which the field is reconstructed at any point; a time between them is reached by solving on from
the last one. The solves are kept by ``solutions``.

| symbol | meaning | shape | unit |
|---|---|---|---|
| theta | parameters of the flow | (p,) | each its own |
| c | field, kept as cell averages | (k, nx, ny) | field |
| rho | diffusivity | | length^2/time |
| g, h | source, initial feature | | field/time, field |
"""

from __future__ import annotations

import hashlib
import itertools
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fieldrl import __version__
from fieldrl.core import checks
from fieldrl.core.domain import Domain, Grid
from fieldrl.core.parameters import Parameters
from fieldrl.pde import sampling
from fieldrl.pde.discretisation import MOST_SUBSTEPS, Discretisation, Source
from fieldrl.pde.flow import DoubleGyre, Flow
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.inside import check_inside
from fieldrl.pde.solutions import Solutions, key

_ORDERS = (3, 5, 7, 9)
_FEWEST_CELLS = 9  # what sampling between cells needs
_CELLS_PER_FEATURE = 5.0
_SCHEME = f"finite volumes 2, fieldrl {__version__}"


class CoarseGrid(UserWarning):
    """A grid on which the initial feature cannot be followed."""


def _feature() -> InitialFeature:
    return InitialFeature(centre=(60.0, 40.0), scale=20.0)


def _basin() -> Domain:
    return Domain(upper=(200.0, 100.0))


@dataclass(frozen=True)
class AdvectionDiffusion:
    """A feature that a flow stirs and diffusion spreads; a forward model.

    Walls are closed to diffusion. Where the flow has no normal velocity on them (the double gyre) they are
    closed altogether and mass is kept; where it has one (uniform flow), the water carries its feature out
    freely and comes in with the value that it has at the wall.

    Args:
        flow: moves the water; its parameters are the unknowns.
        initial: h(x).
        source: g(x, t), or None.
        diffusivity: rho >= 0 [length^2/time].
        domain: a rectangle; obstacles are closed walls, round which the flow is led.
        cells: (nx, ny), at least 9 each.
        final_time: how far a solve reaches [time].
        interval: time between the states that a solve leaves [time].
        true: parameters of the true field, (p,).
        lower: lower bounds of the parameters, (p,).
        upper: upper bounds of the parameters, (p,).
        truth_refinement: how many times finer each side of the true field's grid is.
        order: of the upwind stencils, 3, 5, 7 or 9.
        courant: share of the stability limit that a time step uses, in (0, 1].
        positive: limit the fluxes so that no cell becomes negative (slower; first order at new extremes).
        solutions: where solves are kept.
    """

    flow: Flow = field(default_factory=DoubleGyre)
    initial: InitialFeature = field(default_factory=_feature)
    source: Source | None = None
    diffusivity: float = 1.0
    domain: Domain = field(default_factory=_basin)
    cells: Sequence[int] = (142, 71)
    final_time: float = 10.0
    interval: float = 1.0
    true: Sequence[float] = (0.25, float(np.pi / 5))
    lower: Sequence[float] = (0.0, 0.1)
    upper: Sequence[float] = (0.5, 1.3)
    truth_refinement: int = 2
    order: int = 9
    courant: float = 0.95
    positive: bool = False
    solutions: Solutions = field(default_factory=Solutions, compare=False)

    def __post_init__(self) -> None:
        for name in ("true", "lower", "upper"):
            values = checks.vector(name, getattr(self, name), len(self.flow.names))
            object.__setattr__(self, name, values)
        checks.ordered_bounds(self.lower, self.upper, self.true, ", ".join(self.flow.units))
        checks.not_negative("diffusivity", self.diffusivity, "length^2/time")
        checks.positive("final_time", self.final_time, "time")
        checks.positive("interval", self.interval, "time")
        checks.integer("truth_refinement", self.truth_refinement, 1)
        checks.boolean("positive", self.positive)
        self._check_scheme()
        self._check_feature()
        self._check_bounds()

    def _check_scheme(self) -> None:
        if self.order not in _ORDERS:
            raise checks.InvalidValue("order", self.order, "must be 3, 5, 7 or 9")
        checks.positive("courant", self.courant)
        checks.between("courant", self.courant, 0.0, 1.0)
        if (
            isinstance(self.cells, str)
            or not isinstance(self.cells, Sequence | np.ndarray)
            or len(self.cells) != 2
        ):
            raise checks.InvalidValue("cells", self.cells, "must be [nx, ny]")
        cells = tuple(checks.integer("cells", n, _FEWEST_CELLS) for n in self.cells)
        object.__setattr__(self, "cells", cells)

    def _check_feature(self) -> None:
        """Warns, with the number, where the feature rises over too few cells."""
        if self.positive and self._start.min() < 0:
            raise checks.InvalidValue("positive", True, "needs an initial feature that is nowhere negative")
        free = sampling.cell_averages(self.initial.value, *self._scheme.edges)
        resolved = sampling.cells_per_rise(free)
        if resolved < _CELLS_PER_FEATURE:
            warnings.warn(
                f"cells={list(self.cells)}: the initial feature rises over {resolved:.1f} cells; "
                f"the solver needs at least {_CELLS_PER_FEATURE:g} to follow it",
                CoarseGrid,
                stacklevel=4,
            )

    def _check_bounds(self) -> None:
        """Refuses bounds that hold a flow which this grid cannot follow."""
        times = np.linspace(0.0, self.final_time, 9)
        for corner in itertools.product(*zip(self.lower, self.upper, strict=True)):
            with np.errstate(all="ignore"):
                psi = self._scheme.streamfunction(np.array(corner), times)
                stable = (
                    self._scheme.follows(psi) and self._scheme.substeps(psi, self.final_time) <= MOST_SUBSTEPS
                )
            if not stable:
                rule = f"the bounds hold a flow that the grid cannot follow stably, theta={list(corner)}"
                raise checks.InvalidValue(
                    "upper", self.upper, rule, remedy="narrow the bounds or refine the grid"
                )

    @cached_property
    def parameters(self) -> Parameters:
        """Those of the flow."""
        flow = self.flow
        return Parameters(flow.names, flow.units, tuple(self.lower), tuple(self.upper), tuple(self.true))

    @property
    def horizon(self) -> float:
        """The last time that it can predict [time]."""
        return self.final_time

    @cached_property
    def grid(self) -> Grid:
        """Where the field is recorded: the cells' centres."""
        return self.domain.grid(*self.cells)

    @cached_property
    def _scheme(self) -> Discretisation:
        nx, ny = self.cells
        physics = self.flow, self.source, self.diffusivity, self.domain
        return Discretisation(*physics, (nx, ny), self.order, self.courant, self.positive)

    @cached_property
    def _start(self) -> NDArray[np.float64]:
        """Cell averages of h, (nx, ny)."""
        return self._scheme.averages(self.initial.value)

    @cached_property
    def _key(self) -> str:
        """All that a solve depends on but theta."""
        parts = (self.flow, self.initial, self.source, self.diffusivity, self.domain, self.cells)
        options = (self.final_time, self.interval, self.order, self.courant, self.positive)
        return key(_SCHEME, *parts, *options)

    @cached_property
    def snapshot_times(self) -> NDArray[np.float64]:
        """Times at which a solve leaves its state, 0 and final_time included, (k,) [time]."""
        whole = np.arange(int(np.ceil(self.final_time / self.interval - 1e-9))) * self.interval
        return np.append(whole, self.final_time)

    def truth(self) -> AdvectionDiffusion:
        """The model that generates the true field: the same physics on a finer grid."""
        return replace(self, cells=tuple(n * self.truth_refinement for n in self.cells))

    def solve(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Cell averages at ``snapshot_times`` for theta (p,), (k, nx, ny) [field unit]; or SolveFailed."""
        return self._solution(self._checked(theta)[0])

    def predict(self, theta: NDArray, positions: NDArray, times: NDArray) -> NDArray[np.float64]:
        """The field of m candidates at n samples.

        Args:
            theta: candidates, (m, p).
            positions: in the domain, (n, 2) [length].
            times: in [0, final_time], (n,) [time].

        Returns:
            (m, n) [field unit].

        Raises:
            OutsideDomain: a sample outside the domain or the time that is solved.
            SolveFailed: an unstable or non-finite solve; carries theta and the time.
        """
        positions = np.asarray(positions, dtype=float).reshape(-1, 2)
        times = np.asarray(times, dtype=float).reshape(-1)
        check_inside(positions, times, self.domain, self.final_time)
        around, nearest, between = self._stencils(positions), *self._nearest(times)
        candidates, late = self._checked(theta), np.flatnonzero(between)
        values = np.empty((len(candidates), len(times)))
        for candidate, row in zip(candidates, values, strict=True):
            sampling.values(self._solution(candidate), nearest, *around, row)
            for i in late:
                at, (x, y, along_x, along_y) = slice(i, i + 1), (part[i : i + 1] for part in around)
                state = self._state(candidate, times[i])[None]
                sampling.values(state, np.zeros(1, np.int64), x, y, along_x, along_y, row[at])
        return self._clipped(values)

    def field(self, theta: NDArray, time: float, grid: Grid) -> NDArray[np.float64]:
        """The field on ``grid``, 0 in obstacles, (nx, ny) [field unit]; errors as ``predict``."""
        check_inside(self._corners(grid), np.full(2, float(time)), self.domain, self.final_time)
        (x0, y0), (x1, y1) = self.domain.lower, self.domain.upper
        across = sampling.matrix(grid.x, x0, x1, self.cells[0])
        along = sampling.matrix(grid.y, y0, y1, self.cells[1])
        near = self._scheme.nearest_water
        values = across @ self._state(self._checked(theta)[0], time)[near[0], near[1]] @ along.T
        if self.domain.obstacles:
            values *= self.domain.contains(grid.points).reshape(values.shape)
        return self._clipped(values)

    def _march(self, theta: NDArray) -> NDArray[np.float64]:
        later = self._scheme.march(theta, self._start, self.snapshot_times.tolist())
        return np.concatenate([self._start[None], later])

    def _nearest(self, times: NDArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """The nearest snapshot of each time, and whether the time lies between snapshots, (n,) each."""
        snapshots = self.snapshot_times
        nearest = np.abs(snapshots - times[:, None]).argmin(axis=1)
        return nearest, np.abs(snapshots[nearest] - times) > 1e-9 * self.interval

    def _solution(self, theta: NDArray) -> NDArray[np.float64]:
        """``solve`` for checked theta."""
        return self.solutions.get(self._name(theta), lambda: self._march(theta))

    def _name(self, theta: NDArray, times: tuple[float, ...] = ()) -> str:
        """What the store calls a solve, or its state between two times."""
        told = self._key.encode() + theta.tobytes() + np.array(times).tobytes()
        return hashlib.blake2b(told, digest_size=20).hexdigest()

    def _state(self, theta: NDArray, time: float) -> NDArray[np.float64]:
        """Cell averages at any time of the solve, (nx, ny)."""
        solution, (nearest, between) = self._solution(theta), self._nearest(np.array([time]))
        if not between[0]:
            return solution[nearest[0]]
        last = int(np.searchsorted(self.snapshot_times, time)) - 1
        span = (float(self.snapshot_times[last]), float(time))
        march = self._scheme.march
        return self.solutions.get(self._name(theta, span), lambda: march(theta, solution[last], span)[0])

    def _stencils(self, positions: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Cells round every position, x and y (n, WIDTH, WIDTH), and their weights, x and y (n, WIDTH)."""
        sides = zip(positions.T, self.domain.lower, self.domain.upper, self.cells, strict=True)
        (ix, wx), (iy, wy) = (sampling.stencil(*side) for side in sides)
        near = self._scheme.nearest_water
        x, y = ix[:, :, None], iy[:, None, :]
        return near[0][x, y], near[1][x, y], wx, wy

    def _clipped(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Without the undershoots that sampling between cells makes, where nothing may be negative."""
        return np.maximum(values, 0.0) if self.positive else values

    def _checked(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Candidates (m, p), contiguous and finite."""
        candidates = np.ascontiguousarray(np.atleast_2d(np.asarray(theta, dtype=float)))
        if candidates.ndim != 2 or candidates.shape[1] != len(self.parameters):
            raise checks.InvalidValue("theta", theta, f"must have {len(self.parameters)} components")
        if not np.isfinite(candidates).all():
            for candidate in candidates:
                checks.vector("theta", candidate, len(self.parameters))
        return candidates

    def _corners(self, grid: Grid) -> NDArray[np.float64]:
        return np.array([[grid.x.min(), grid.y.min()], [grid.x.max(), grid.y.max()]])
