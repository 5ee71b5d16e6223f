"""Eq. (29) on one grid: everything that does not depend on theta, and the march through time.

| symbol | meaning | shape | unit |
|---|---|---|---|
| c | cell averages of the field | (nx, ny) | field |
| psi | streamfunction at the cells' corners | (k, nx + 1, ny + 1) | length^2/time |
| | without one, see ``face_means`` | (k, 2, nx + 1, ny + 1) | length^2/time |
| g | cell averages of the source | (k, nx, ny) | field/time |
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.checks import SolveFailed
from fieldrl.core.domain import Domain
from fieldrl.pde.finite_volumes import face_means, limited, obstacles, sampling, stepping
from fieldrl.pde.finite_volumes import fluxes as fv
from fieldrl.pde.finite_volumes import stencils as st
from fieldrl.pde.flow import Flow, Separable
from fieldrl.pde.source import LocalisedSource

MOST_SUBSTEPS = 200_000  # per stretch; a flow that needs more is refused
_MOST_GROWTH = 200.0  # exponent of the growth by water that runs together
_GROWTH = 10.0  # a field that outgrows its initial values and source so far is unstable
_OF_THE_GRID = ("edges", "cell", "solid", "nearest_water", "_shape", "_walls", "_deflection")
_CHUNK = 64  # steps whose streamfunctions are held at once


class Source(Protocol):
    """What enters the water: rate(positions (n, 2), time) -> (n,) [field unit/time]."""

    def rate(self, positions: NDArray[np.float64], time: float) -> NDArray[np.float64]: ...


@dataclass(frozen=True, eq=False)
class Discretisation:
    """The scheme on nx times ny cells.

    Args:
        flow: moves the water.
        source: g, or None.
        diffusivity: rho [length^2/time].
        domain: closed to diffusion at walls and obstacles, and to the flow where psi is constant on them.
        cells: (nx, ny).
        order: of the upwind stencils, 3, 5, 7 or 9.
        courant: share of the stability limit that a step uses.
        positive: whether to limit fluxes so that nothing becomes negative.
    """

    flow: Flow
    source: Source | None
    diffusivity: float
    domain: Domain
    cells: tuple[int, int]
    order: int
    courant: float
    positive: bool

    def differing(self, source: Source | None, diffusivity: float) -> Discretisation:
        """The same grid with another source and diffusivity; what depends on the grid alone is shared."""
        other = replace(self, source=source, diffusivity=diffusivity)
        vars(other).update({name: vars(self)[name] for name in _OF_THE_GRID if name in vars(self)})
        return other

    @cached_property
    def edges(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Coordinates of the cells' edges, (nx + 1,), (ny + 1,) [length]."""
        sides = zip(self.domain.lower, self.domain.upper, self.cells, strict=True)
        x, y = (np.linspace(low, high, n + 1) for low, high, n in sides)
        return x, y

    @cached_property
    def cell(self) -> tuple[float, float]:
        """Cell size (x, y) [length]."""
        x, y = self.edges
        return float(x[1] - x[0]), float(y[1] - y[0])

    @cached_property
    def solid(self) -> NDArray[np.bool_]:
        """Cells that are obstacle, (nx, ny)."""
        return obstacles.solid_cells(self.domain, *self.cells)

    @cached_property
    def nearest_water(self) -> NDArray[np.int64]:
        """For each cell the water cell whose value stands for it, (2, nx, ny)."""
        return obstacles.nearest_water(self.solid)

    @cached_property
    def _shape(self) -> st.Layout:
        return st.layout(self.order, *self.cells)

    @cached_property
    def _weights(self) -> st.Stencils:
        return st.stencils(self.order, self.diffusivity, self.cell)

    @cached_property
    def _walls(self) -> st.Walls:
        return obstacles.walls(self.solid, self._shape)

    @cached_property
    def _deflection(self) -> obstacles.Deflection | None:
        return obstacles.Deflection(self.solid, self.cell) if self.solid.any() else None

    @property
    def diffusion_rate(self) -> float:
        """Q = rho (1/hx^2 + 1/hy^2) [1/time]."""
        return self.diffusivity * sum(1 / h**2 for h in self.cell)

    def averages(self, value) -> NDArray[np.float64]:
        """Cell averages of a function of positions, zero in obstacles, (nx, ny)."""
        return np.where(self.solid, 0.0, sampling.cell_averages(value, *self.edges))

    def streamfunction(self, theta: NDArray, times: NDArray) -> NDArray[np.float64]:
        """psi at times (k,), constant on closed walls and obstacles, (k, nx + 1, ny + 1).

        Without a streamfunction: the running sums of ``face_means``, (k, 2, nx + 1, ny + 1).
        """
        if not has_streamfunction(self.flow):
            return face_means.running_sums(self.flow, theta, *self.edges, times)
        psi = _vertex_values(self.flow, theta, *self.edges, times)
        fv.close_walls(psi)
        return psi if self._deflection is None else self._deflection(psi)

    def follows(self, psi: NDArray[np.float64]) -> bool:
        """Is psi finite and smooth on this grid: does the velocity change little from face to face?"""
        if not np.isfinite(psi).all():
            return False
        sides = tuple(zip(_sides(psi), (2, 1), strict=True))
        fastest = max(np.abs(np.diff(side, axis=axis)).max() for side, axis in sides)
        return all(np.abs(np.diff(side, n=2, axis=axis)).max() <= fastest for side, axis in sides)

    def crossing_rate(self, psi: NDArray[np.float64]) -> float:
        """S, the most cells that the water crosses per time [1/time]."""
        return float(fv.crossing_rate(*_sides(psi), self._weights.per_x, self._weights.per_y))

    def substeps(self, psi: NDArray[np.float64], span: float) -> int:
        """How many substeps the flow psi needs for a span of time."""
        rate = self._rate(psi)
        return 2 * stepping.steps_for(span, rate) if np.isfinite(rate) else MOST_SUBSTEPS + 1

    def march(
        self, theta: NDArray, averages: NDArray[np.float64], times: Sequence[float]
    ) -> NDArray[np.float64]:
        """Cell averages at times[1:], from those at times[0].

        Args:
            theta: (p,).
            averages: (nx, ny).
            times: increasing, (k + 1,) [time].

        Returns:
            (k, nx, ny).

        Raises:
            SolveFailed: the field is no longer finite, has grown without cause, or the flow is too fast.
        """
        state = _State(st.padded(averages, self._shape), st.scratch(self._shape), self._shape)
        bound = _GROWTH * np.abs(averages).max()
        kept = np.empty((len(times) - 1, *self.cells))
        for k, (start, end) in enumerate(pairwise(times)):
            for low, high in self._stretches(start, end):
                added, grown = self._carry(theta, state, low, high)
                bound = grown * bound + _GROWTH * added
            kept[k] = np.where(self.solid, 0.0, st.interior(state.cells, self._shape))
            _check(kept[k], bound, theta, end)
        return kept

    def _stretches(self, start: float, end: float) -> list[tuple[float, float]]:
        """The span, cut where the source opens or closes."""
        cuts = (getattr(self.source, name, None) for name in ("opens", "closes"))
        points = [start, *sorted(cut for cut in cuts if cut is not None and start < cut < end), end]
        return list(pairwise(points))

    def _rate(self, psi: NDArray[np.float64]) -> float:
        """Substeps (steps where positive) per time that psi needs."""
        speed = self.crossing_rate(psi)
        if self.positive:
            return 2 * limited.step_rate(speed, self.diffusion_rate) / self.courant
        return stepping.substep_rate(self.order, speed, self.diffusion_rate) / self.courant

    def _carry(self, theta: NDArray, state: _State, start: float, end: float) -> tuple[float, float]:
        """Advance the state over a stretch; returns the most that the source adds, and the most that water
        which runs together multiplies."""
        span = end - start
        looked_at = self.streamfunction(theta, start + span * np.array([0.0, 0.5, 1.0]))
        steps = self._steps(looked_at, span, theta, start)
        added, begin, length = 0.0, 0, span / steps
        while begin < steps:
            count = min(_CHUNK, steps - begin)
            psi, rates = self._frozen(theta, start + begin * length, count * length, count, (start, end))
            if (needed := self._steps(psi, span, theta, start)) > steps and begin == 0:
                steps, length = needed, span / needed
                continue
            self._advance(state, psi, rates, length)
            begin += count
            added = max(added, span * float(np.abs(rates).max(initial=0.0)))
        return added, self._grown(looked_at, span)

    def _grown(self, psi: NDArray[np.float64], span: float) -> float:
        """How many times greater a field can become where water runs together for a span of time."""
        if psi.ndim == 3:
            return 1.0
        rate = face_means.shrinking(psi, self.cell[0] * self.cell[1])
        return float(np.exp(min(rate * span, _MOST_GROWTH)))

    def _steps(self, psi: NDArray[np.float64], span: float, theta: NDArray, time: float) -> int:
        rate = self._rate(psi)
        if not np.isfinite(rate) or rate * span > MOST_SUBSTEPS:
            raise SolveFailed(theta.tolist(), time, f"the flow needs {rate:.3g} substeps per time")
        return stepping.steps_for(span, rate)

    def _frozen(self, theta, start, span, count, stretch) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """psi and g of each (sub)step of ``count`` steps."""

        def psi(times):
            return self.streamfunction(theta, times)

        def source(times):
            return self._source(times, stretch)

        hold = stepping.stages if self.positive else stepping.frozen
        return hold(psi, start, span, count), hold(source, start, span, count)

    def _source(self, times: NDArray[np.float64], stretch: tuple[float, float]) -> NDArray[np.float64]:
        """g at times (k,), taken inside the stretch, as padded cells (k, size); (k, 0) without a source."""
        if self.source is None:
            return np.zeros((len(times), 0))
        margin = 1e-9 * (stretch[1] - stretch[0])
        inside = np.clip(times, stretch[0] + margin, stretch[1] - margin)
        if isinstance(self.source, LocalisedSource):  # steady while it is open
            return np.repeat(self._source_at(inside[0])[None], len(times), axis=0)
        return np.stack([self._source_at(time) for time in inside])

    def _source_at(self, time: float) -> NDArray[np.float64]:
        source = self.source
        averages = (
            self.averages(lambda positions: source.rate(positions, time)) if source else np.zeros(self.cells)
        )
        return st.padded(averages, self._shape)

    def _advance(self, state: _State, psi: NDArray, rates: NDArray, length: float) -> None:
        """One compiled call over all steps of length ``length``."""
        sides = [self._padded(side) for side in (_sides(psi) if psi.ndim == 4 else (psi,))]
        flow = sides[0], sides[-1]
        common = (self._shape, self._weights, self._walls, state.work)
        if self.positive:
            faces = limited.faces(self._shape)
            limited.advance(state.cells, *flow, rates, length, *common, self.diffusivity, faces, state.spare)
        else:
            fv.advance(state.cells, *flow, rates, length / 2, stepping.CHAIN, *common, state.spare)

    def _padded(self, psi: NDArray[np.float64]) -> NDArray[np.float64]:
        """psi (k, nx + 1, ny + 1) as the compiled stencils read it."""
        padded = np.zeros((len(psi), (self.cells[0] + 3) * (self._shape.whole + 3 + st.VECTOR)))
        fv.vertices(psi, self._shape, padded)
        return padded


class _State:
    """The field on its way through time, and the arrays that it needs."""

    def __init__(self, cells: NDArray[np.float64], work: st.Scratch, shape: st.Layout) -> None:
        self.cells, self.work, self.shape = cells, work, shape
        self.spare = np.zeros((2, cells.size))


def has_streamfunction(flow: Any) -> bool:
    """Whether the flow has a streamfunction."""
    return isinstance(flow, Separable) or getattr(flow, "streamfunction", None) is not None


def _sides(psi: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What faces normal to x and to y take their differences of, (k, nx + 1, ny + 1) each."""
    return (psi, psi) if psi.ndim == 3 else (psi[:, 0], psi[:, 1])


def _vertex_values(flow: Any, theta: NDArray, x: NDArray, y: NDArray, times: NDArray) -> NDArray[np.float64]:
    """psi at the corners (x_i, y_j) at all times, (k, nx + 1, ny + 1)."""
    if isinstance(flow, Separable):
        of_x, of_y = flow.factors(theta, x, y, times)
        return np.einsum("kri,rj->kij", of_x, of_y)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.stack([flow.streamfunction(theta, points, t).reshape(len(x), len(y)) for t in times])


def _check(averages: NDArray[np.float64], bound: float, theta: NDArray, time: float) -> None:
    """Raises SolveFailed where the field is not finite or beyond ``bound``."""
    largest = float(np.abs(averages).max())
    if not largest <= bound:
        reason = f"the field reached {largest:.3g}" if np.isfinite(largest) else "the field is not finite"
        raise SolveFailed(theta.tolist(), time, reason)
