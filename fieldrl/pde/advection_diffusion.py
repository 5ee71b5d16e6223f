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
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cached_property, partial
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fieldrl import __version__
from fieldrl.core import checks
from fieldrl.core.cost import Cost, Extent
from fieldrl.core.domain import Domain, Grid
from fieldrl.core.flow_adapter import adapted
from fieldrl.core.kinds import OR_NULL, component
from fieldrl.core.parameters import Parameters
from fieldrl.pde.finite_volumes import feasible, resolution, sampling
from fieldrl.pde.finite_volumes.discretisation import Discretisation, Source, has_streamfunction
from fieldrl.pde.finite_volumes.inside import check_inside
from fieldrl.pde.flow import DoubleGyre, Flow
from fieldrl.pde.initial import Feature, InitialFeature, check_visible
from fieldrl.pde.solutions import Solutions, key
from fieldrl.pde.truth import differing
from fieldrl.pde.unknowns import Unknowns, check_sides, check_truth, steepest, unknowns

_ORDERS = (3, 5, 7, 9)
_SCHEMES = {"finite_volumes": f"finite volumes 2, fieldrl {__version__}", "semi_lagrangian": "1"}
_MAY_DIFFER = ("flow", "initial", "source", "diffusivity", "scheme", "order", "courant", "positive")


class _Candidate(NamedTuple):
    """theta (p,), the parts there, and the key of all that a solve depends on but the flow's parameters."""

    theta: NDArray[np.float64]
    parts: Mapping[str, Any]
    key: str


@component
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
        true: parameters of the true field, (p,), null where nobody knows them.
        lower: lower bounds of the parameters, (p,).
        upper: upper bounds of the parameters, (p,).
        truth_refinement: how many times finer each side of the true field's grid is.
        true_model: what else differs in the true field's model, see ``truth.differing``; None: nothing.
        scheme: finite_volumes, or semi_lagrangian: another method, to compare with, not for obstacles.
        order: of the upwind stencils, 3, 5, 7 or 9.
        courant: share of the stability limit that a time step uses, in (0, 1].
        positive: limit the fluxes so that no cell becomes negative (slower; first order at new extremes).
        solutions: where solves are kept.
        unknown: what is unknown, {name: {true, lower, upper}}, see ``unknowns``; None: the flow's parameters.
    """

    flow: Flow = field(default_factory=DoubleGyre)
    initial: Feature = field(default_factory=partial(InitialFeature, centre=(60.0, 40.0), scale=20.0))
    source: Source | None = None
    diffusivity: float = 1.0
    domain: Domain = field(default_factory=partial(Domain, upper=(200.0, 100.0)))
    cells: Sequence[int] = (142, 71)
    final_time: float = 10.0
    interval: float = 1.0
    true: Annotated[Sequence[float | None], OR_NULL] = (0.25, float(np.pi / 5))
    lower: Sequence[float] = (0.0, 0.1)
    upper: Sequence[float] = (0.5, 1.3)
    truth_refinement: int = 2
    true_model: Mapping[str, Any] | None = None
    scheme: str = "finite_volumes"
    order: int = 9
    courant: float = 0.95
    positive: bool = False
    solutions: Solutions = field(default_factory=Solutions, compare=False)
    unknown: Mapping[str, Any] | None = None

    _most_substeps: ClassVar[int] = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "flow", adapted(self.flow))
        object.__setattr__(self, "true", checks.truth("true", self.true, len(self.flow.names)))
        for name in ("lower", "upper"):
            values = checks.vector(name, getattr(self, name), len(self.flow.names))
            object.__setattr__(self, name, values)
        checks.ordered_bounds(self.lower, self.upper, self.true, ", ".join(self.flow.units))
        checks.not_negative("diffusivity", self.diffusivity, "length^2/time")
        checks.positive("final_time", self.final_time, "time")
        checks.positive("interval", self.interval, "time")
        checks.integer("truth_refinement", self.truth_refinement, 1)
        checks.boolean("positive", self.positive)
        check_sides(self._unknowns)
        check_visible(self.initial, self.source, self.parameters.names)
        self._check_scheme()
        self._check_grid()
        self._check_truth()

    def _check_scheme(self) -> None:
        checks.one_of("scheme", self.scheme, tuple(_SCHEMES))
        if self.scheme != "finite_volumes" and (self.domain.obstacles or self.positive):
            rule = "has neither obstacles nor positive=true"
            raise checks.InvalidValue("scheme", self.scheme, rule, remedy="use finite_volumes")
        if not has_streamfunction(self.flow):
            self._check_without_streamfunction()
        if self.order not in _ORDERS:
            raise checks.InvalidValue("order", self.order, "must be 3, 5, 7 or 9")
        checks.positive("courant", self.courant)
        checks.between("courant", self.courant, 0.0, 1.0)
        object.__setattr__(self, "cells", feasible.checked_cells(self.cells, self.truth_refinement))

    def _check_without_streamfunction(self) -> None:
        rule = "needs a flow with a streamfunction"
        if self.domain.obstacles:
            raise checks.InvalidValue("domain.obstacles", self.domain.obstacles, rule)
        if self.scheme == "semi_lagrangian":  # it solves dc/dt + v grad c, which is another equation
            raise checks.InvalidValue("scheme", self.scheme, rule, remedy="use finite_volumes")

    def _check_grid(self) -> None:
        if self.positive and self._start.min() < 0:
            raise checks.InvalidValue("positive", True, "needs an initial feature that is nowhere negative")
        for which, feature in steepest(self._unknowns):
            resolution.check_feature(self._scheme, feature, which)
        parameters = self.parameters
        lower, upper = (self.flow_parameters(np.array(side)) for side in (parameters.lower, parameters.upper))
        scheme = self._scheme.differing(
            None, self._unknowns.parts_at(np.array(parameters.upper))["diffusivity"]
        )
        most = feasible.checked_bounds(scheme, lower.tolist(), upper.tolist(), self.final_time)
        object.__setattr__(self, "_most_substeps", most)

    def _check_truth(self) -> None:
        """Builds the true field's model, which refuses what is impossible."""
        if self.true_model is None:
            return
        truth = self.truth()
        check_truth(self._unknowns, truth._unknowns)
        if (names := truth.flow.names) != self.flow.names:
            rule = f"must have the model's parameters, {', '.join(self.flow.names)}"
            raise checks.InvalidValue("true_model.flow", ", ".join(names), rule)

    @cached_property
    def _unknowns(self) -> Unknowns:
        bounds, own = (
            (self.true, self.lower, self.upper),
            {"diffusivity": (self.diffusivity, "length^2/time")},
        )
        return unknowns(self.unknown, self.flow, bounds, own, source=self.source, initial=self.initial)

    @property
    def parameters(self) -> Parameters:
        """Those of the flow, or what is named in ``unknown``."""
        return self._unknowns.parameters

    def flow_parameters(self, theta: NDArray) -> NDArray[np.float64]:
        """The flow's parameters, those that are not unknown included, at theta (p,)."""
        return self._unknowns.flow_parameters(theta)

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

    def _solver(self, parts: Mapping[str, Any]) -> Any:
        """What marches through time, with these parts."""
        source, diffusivity = parts["source"], parts["diffusivity"]
        if self.scheme == "finite_volumes":
            same = source is self.source and diffusivity == self.diffusivity
            return self._scheme if same else self._scheme.differing(source, diffusivity)
        from fieldrl.pde.semi_lagrangian import SemiLagrangian  # imports SciPy

        return SemiLagrangian(self.flow, source, diffusivity, self.domain, self._scheme.cells)

    @cached_property
    def _start(self) -> NDArray[np.float64]:
        """Cell averages of h, (nx, ny)."""
        return self._scheme.averages(self.initial.value)

    @cached_property
    def _key(self) -> str:
        """All that a solve depends on but theta, where the flow alone is unknown."""
        return self._key_of(self._unknowns.parts)

    def _key_of(self, parts: Mapping[str, Any]) -> str:
        """All that a solve with these parts depends on but the flow's parameters."""
        physics = (
            self.flow,
            parts["initial"],
            parts["source"],
            parts["diffusivity"],
            self.domain,
            self.cells,
        )
        options = (self.final_time, self.interval, self.order, self.courant, self.positive)
        return key(_SCHEMES[self.scheme], *physics, *options)

    @cached_property
    def snapshot_times(self) -> NDArray[np.float64]:
        """Times at which a solve leaves its state, 0 and final_time included, (k,) [time]."""
        whole = np.arange(int(np.ceil(self.final_time / self.interval - 1e-9))) * self.interval
        return np.append(whole, self.final_time)

    @property
    def snapshots(self) -> int:
        """How many states a solve leaves."""
        return int(np.ceil(self.final_time / self.interval - 1e-9)) + 1

    def solve_seconds(self, samples: int) -> float:
        """Time to predict one candidate, however many the samples [s]."""
        return feasible.solve_seconds(self._scheme, max(self._most_substeps, 2 * self.snapshots))

    def cost(self, extent: Extent) -> Cost:
        """The true field's solve, working arrays and stored solves."""
        size = self.cells, self.snapshots, self.truth_refinement
        return feasible.cost(extent, *size, self.solve_seconds(1), self.solutions.memory * 2.0**20)

    def truth(self) -> AdvectionDiffusion:
        """The model that generates the true field: on a finer grid, and with what ``true_model`` changes."""
        finer = tuple(n * self.truth_refinement for n in self.cells)
        changes = {} if self.true_model is None else self.true_model
        besides = {"cells": finer, "truth_refinement": 1, "true_model": None}
        return differing(self, changes, _MAY_DIFFER, **besides)

    def admissible(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The nearest positions (n, 2) in the domain's rectangle: the grid ends at the walls [length]."""
        return np.clip(positions, self.domain.lower, self.domain.upper)

    def solve(self, theta: ArrayLike) -> NDArray[np.float64]:
        """Cell averages at ``snapshot_times`` for theta (p,), (k, nx, ny) [field unit]; or SolveFailed."""
        return self._solution(self._candidate(self._checked(theta)[0]))

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
        for theta_of, row in zip(candidates, values, strict=True):
            candidate = self._candidate(theta_of)
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
        state = self._state(self._candidate(self._checked(theta)[0]), time)
        values = across @ state[near[0], near[1]] @ along.T
        if self.domain.obstacles:
            values *= self.domain.contains(grid.points).reshape(values.shape)
        return self._clipped(values)

    def _candidate(self, theta: NDArray) -> _Candidate:
        """What solves at theta (p,) have in common."""
        found = self._unknowns
        if found.of_flow_alone:
            return _Candidate(theta, found.parts, self._key)
        parts = found.parts_at(theta)
        return _Candidate(theta, parts, self._key_of(parts))

    def _march(self, candidate: _Candidate) -> NDArray[np.float64]:
        parts = candidate.parts
        start = self._start if parts["initial"] is self.initial else self._averages(parts["initial"])
        later = self._carry(candidate, start, self.snapshot_times.tolist())
        return np.concatenate([start[None], later])

    def _averages(self, initial: Feature) -> NDArray[np.float64]:
        return self._scheme.averages(initial.value)

    def _carry(self, candidate: _Candidate, state: NDArray, times: Sequence[float]) -> NDArray[np.float64]:
        """Cell averages at times[1:] of a candidate, (k, nx, ny); a failed solve tells theta."""
        theta = candidate.theta
        try:
            return self._solver(candidate.parts).march(self.flow_parameters(theta), state, times)
        except checks.SolveFailed as error:
            raise checks.SolveFailed(theta.tolist(), error.time, error.reason) from None

    def _nearest(self, times: NDArray) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """The nearest snapshot of each time, and whether the time lies between snapshots, (n,) each."""
        snapshots = self.snapshot_times
        nearest = np.abs(snapshots - times[:, None]).argmin(axis=1)
        return nearest, np.abs(snapshots[nearest] - times) > 1e-9 * self.interval

    def _solution(self, candidate: _Candidate) -> NDArray[np.float64]:
        """``solve`` for a candidate."""
        return self.solutions.get(self._name(candidate), lambda: self._march(candidate))

    def _name(self, candidate: _Candidate, times: tuple[float, ...] = ()) -> str:
        """What the store calls a solve, or its state between two times."""
        of_flow = self.flow_parameters(candidate.theta)
        told = candidate.key.encode() + of_flow.tobytes() + np.array(times).tobytes()
        return hashlib.blake2b(told, digest_size=20).hexdigest()

    def _state(self, candidate: _Candidate, time: float) -> NDArray[np.float64]:
        """Cell averages at any time of the solve, (nx, ny)."""
        solution, (nearest, between) = self._solution(candidate), self._nearest(np.array([time]))
        if not between[0]:
            return solution[nearest[0]]
        last = int(np.searchsorted(self.snapshot_times, time)) - 1
        span = (float(self.snapshot_times[last]), float(time))

        def carried() -> NDArray[np.float64]:
            return self._carry(candidate, solution[last], span)[0]

        return self.solutions.get(self._name(candidate, span), carried)

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
