"""Eq. (29) by another method, to compare with: characteristics, splines and cosines instead of fluxes.

It shares nothing with the finite volumes but the cells. The water's velocity is taken at points, not as
differences of the streamfunction; the field is carried along characteristics and interpolated by quintic
splines, not moved by fluxes; diffusion is exact in cosines, which are flat at the walls. The two are combined
by Strang's splitting, of order 2 in time. Mass is not kept to rounding, and there are no obstacles.

| symbol | meaning | shape | unit |
|---|---|---|---|
| c | field at the cells' centres | (nx, ny) | field |
| k | wave numbers of the cosines | (nx,), (ny,) | 1/length |
| x* | where the water at a centre was one step before | (n, 2) | length |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn
from scipy.ndimage import map_coordinates

from fieldrl.core.checks import SolveFailed
from fieldrl.core.domain import Domain
from fieldrl.pde.finite_volumes.discretisation import MOST_SUBSTEPS, Source
from fieldrl.pde.flow import Flow

_CELLS_PER_STEP = 4.0  # the fastest water crosses so many cells in a step
_SPLINE = 5  # degree of the interpolation


@dataclass(frozen=True, eq=False)
class SemiLagrangian:
    """The scheme on nx times ny cells of a rectangle without obstacles.

    Args:
        flow: moves the water.
        source: g, or None.
        diffusivity: rho [length^2/time].
        domain: its walls are closed to diffusion; water that comes in has the value at the wall.
        cells: (nx, ny).
    """

    flow: Flow
    source: Source | None
    diffusivity: float
    domain: Domain
    cells: tuple[int, int]

    def march(
        self, theta: NDArray, averages: NDArray[np.float64], times: Sequence[float]
    ) -> NDArray[np.float64]:
        """Cell averages at times[1:], from those at times[0]; as ``Discretisation.march``."""
        waves, kept = _cosines(averages) / self._averaging, []
        for start, end in pairwise(times):
            waves = self._carry(theta, waves, start, end)
            kept.append(_values(waves * self._averaging))
            if not np.isfinite(kept[-1]).all():
                raise SolveFailed(theta.tolist(), end, "the field is not finite")
        return np.stack(kept)

    @cached_property
    def _centres(self) -> NDArray[np.float64]:
        return self.domain.grid(*self.cells).points

    @cached_property
    def _size(self) -> NDArray[np.float64]:
        """Of a cell, (2,) [length]."""
        return np.subtract(self.domain.upper, self.domain.lower) / self.cells

    @cached_property
    def _averaging(self) -> NDArray[np.float64]:
        """What the mean over a cell leaves of each cosine, (nx, ny)."""
        along_x, along_y = (np.sinc(np.arange(n) / (2 * n)) for n in self.cells)
        return along_x[:, None] * along_y

    @cached_property
    def _decay(self) -> NDArray[np.float64]:
        """Rate rho k^2 at which diffusion takes each cosine away, (nx, ny) [1/time]."""
        kx, ky = (np.pi * np.arange(n) / (n * h) for n, h in zip(self.cells, self._size, strict=True))
        return self.diffusivity * (kx[:, None] ** 2 + ky**2)

    def _carry(self, theta: NDArray, waves: NDArray, start: float, end: float) -> NDArray[np.float64]:
        """The cosines' amplitudes at the end of a stretch: half a step of diffusion, a step of flow, half."""
        steps = self._steps(theta, start, end)
        length = (end - start) / steps
        half = np.exp(-0.5 * length * self._decay)
        for step in range(steps):
            moved = self._moved(theta, _values(waves * half), start + step * length, length)
            waves = _cosines(moved) * half
        return waves

    def _steps(self, theta: NDArray, start: float, end: float) -> int:
        """How many steps follow the flow from start to end."""
        times = start + (end - start) * np.array([0.0, 0.5, 1.0])
        crossed = [np.abs(self.flow.velocity(theta, self._centres, t) / self._size).max() for t in times]
        needed = (end - start) * max(crossed) / _CELLS_PER_STEP
        if not needed <= MOST_SUBSTEPS:
            raise SolveFailed(theta.tolist(), start, f"the flow needs {needed:.3g} steps")
        return max(1, math.ceil(needed))

    def _moved(self, theta: NDArray, field: NDArray, time: float, length: float) -> NDArray[np.float64]:
        """The field at the centres one step later: what was at x*, and what the source gave on the way."""
        centres, low, high = self._centres, self.domain.lower, self.domain.upper
        before = np.clip(self._traced(theta, time + length, length), low, high)
        places = ((before - low) / self._size - 0.5).T
        values = map_coordinates(field, places, order=_SPLINE, mode="reflect")
        if self.source is not None:
            values += length * self.source.rate(0.5 * (centres + before), time + 0.5 * length)
        return values.reshape(field.shape)

    def _traced(self, theta: NDArray, time: float, length: float) -> NDArray[np.float64]:
        """Where the water at the centres was ``length`` before ``time``, by classical Runge-Kutta, (n, 2)."""
        x, middle = self._centres, time - 0.5 * length
        k1 = self.flow.velocity(theta, x, time)
        k2 = self.flow.velocity(theta, x - 0.5 * length * k1, middle)
        k3 = self.flow.velocity(theta, x - 0.5 * length * k2, middle)
        k4 = self.flow.velocity(theta, x - length * k3, time - length)
        return x - length / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def _cosines(values: NDArray) -> NDArray[np.float64]:
    """Amplitudes of the cosines, (nx, ny), from values at the centres."""
    return np.asarray(dctn(values, norm="ortho"))


def _values(cosines: NDArray) -> NDArray[np.float64]:
    """Values at the centres, (nx, ny), from amplitudes of the cosines."""
    return np.asarray(idctn(cosines, norm="ortho"))
