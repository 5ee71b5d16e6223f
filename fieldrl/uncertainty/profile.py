"""Profile-likelihood intervals: all values of an unknown that fit nearly as well as the best.

An unknown k is stepped away from a place that fits; the other unknowns follow by least squares (the profile);
where the deviance has risen by q the interval ends, or at a bound. All places, unknowns and sides march at
once. Places are the distinct minima, and points of the box that fit: so valleys, plateaus and several
solutions are covered, and an interval may have several pieces.

| symbol | meaning | shape |
|---|---|---|
| D | deviance | |
| D0, q | its least value, what it may rise | |
| u | scaled unknowns | (p,) [half-width] |
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldrl.uncertainty.deviance import Deviance, descend

_PRECISE = 0.002  # of q: an end is found
_CLOSE = 2e-4  # of its distance from where the march began: the same
_STEPS = 40  # of a march, at most
_EAGER, _FARTHEST = 1.05, 3.0  # a step aims a little beyond the end; at most so many times the last


class Profile(NamedTuple):
    """Intervals of every unknown at one level.

    Args:
        pieces: for each unknown its separate intervals in ascending order, (low, high) [half-width].
        ends: where the outermost ends lie: for each unknown and side the point u, (p, 2, p).
    """

    pieces: tuple[tuple[tuple[float, float], ...], ...]
    ends: NDArray[np.float64]

    @property
    def intervals(self) -> NDArray[np.float64]:
        """Least and greatest value of each unknown, (p, 2) [half-width]."""
        return np.array([(parts[0][0], parts[-1][1]) for parts in self.pieces])

    def half_widths(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of the piece about each unknown of a point u (p,), (p,) [half-width]; 0 where it lies in none."""
        about = zip(u, self.pieces, strict=True)
        return np.array(
            [sum(high - low for low, high in parts if low <= v <= high) / 2 for v, parts in about]
        )


def profile(
    deviance: Deviance, places: NDArray[np.float64], least: float, rise: float, std: NDArray[np.float64]
) -> Profile:
    """Intervals of all unknowns.

    Args:
        deviance: D.
        places: points that fit, D <= least + rise, (m, p), the best first.
        least: D0.
        rise: q.
        std: standard deviation of each unknown where it is known, for the first step, (p,) [half-width].
    """
    p = places.shape[1]
    if not np.isfinite(rise):
        ends = np.repeat(np.repeat(places[0][None, None], p, axis=0), 2, axis=1)
        for k in range(p):
            ends[k, :, k] = -1.0, 1.0
        return Profile((((-1.0, 1.0),),) * p, ends)
    march = _March(deviance, places, least + rise, rise, std)
    march.run()
    low, high = march.c_end.reshape(len(places), p, 2).transpose(2, 1, 0)
    pieces = tuple(_merged(low[k], high[k]) for k in range(p))
    points, ends = march.points().reshape(len(places), p, 2, p), np.empty((p, 2, p))
    for k in range(p):
        ends[k] = points[np.argmin(low[k]), k, 0], points[np.argmax(high[k]), k, 1]
    return Profile(pieces, ends)


def constrained(deviance: Deviance, u: NDArray[np.float64], k: int, values: NDArray) -> NDArray[np.float64]:
    """The profile of unknown k: least D where u_k is each of ``values`` (m,), walking from u (p,); (m,)."""
    held, found = np.zeros((1, u.size), dtype=bool), np.empty(len(values))
    held[0, k] = True
    order = np.argsort(values)
    start = int(np.searchsorted(values[order], u[k]))
    for part in (order[start:], order[:start][::-1]):
        at = u[None].copy()
        for i in part:
            at[0, k] = values[i]
            at, loss = descend(deviance, at, held)
            found[i] = loss[0]
    return found


class _March:
    """The marches of every place (m), unknown (p) and side (2), one row each."""

    def __init__(self, deviance: Deviance, places: NDArray, bar: float, rise: float, std: NDArray) -> None:
        m, p = places.shape
        self.deviance, self.bar, self.rise = deviance, bar, rise
        self.k = np.tile(np.repeat(np.arange(p), 2), m)
        self.side = np.tile([-1.0, 1.0], m * p)
        self.inside = np.repeat(places, 2 * p, axis=0)
        self.rows = np.arange(len(self.k))
        self.origin = self.inside[self.rows, self.k]
        self.d_origin = np.repeat(np.minimum(deviance.at(places), bar), 2 * p)
        self.c_in, self.d_in = self.origin.copy(), self.d_origin.copy()
        self.c_out, self.d_out = self.c_in.copy(), np.full(len(self.k), bar)
        self.met = np.zeros(len(self.k), dtype=bool)  # whether c_out is known to lie outside
        first = np.where(np.isfinite(std), std, 1.0)[self.k] * np.sqrt(rise)
        self.step = np.clip(first * np.sqrt(np.maximum(bar - self.d_origin, 0.01 * rise) / rise), 1e-7, 0.5)
        self.drift = np.zeros_like(self.inside)  # of the other unknowns, for each step of unknown k
        self.c_end = self.c_in.copy()

    def run(self) -> None:
        """Until every march has found its end."""
        going = self.rows[self.side * self.c_in < 1.0]
        for step in range(_STEPS):
            if not going.size:
                break
            self._try(going, self._next(going, halve=step % 4 == 3))
            going = going[~self._ended(going)]
        self.c_end = np.where(self.met, self._between(self.rows), self.c_in)

    def points(self) -> NDArray[np.float64]:
        """Points u at the ends, (rows, p)."""
        ends = self.inside + self.drift * (self.c_end - self.c_in)[:, None]
        ends[self.rows, self.k] = self.c_end
        return np.clip(ends, -1.0, 1.0)

    def _next(self, going: NDArray, halve: bool) -> NDArray:
        """Where unknown k is tried next; now and then by halving, so that no march comes to a standstill."""
        onwards = np.clip(self.c_in[going] + (self.side * self.step)[going], -1.0, 1.0)
        between = (self.c_in + self.c_out)[going] / 2 if halve else self._between(going)
        return np.where(self.met[going], between, onwards)

    def _between(self, rows: NDArray) -> NDArray:
        """Where D meets the bar between inside and outside: its root, less D0, is nearly straight."""
        base = self.d_origin[rows]
        z_in, z_out, z_bar = (
            np.sqrt(np.maximum(d - base, 0.0)) for d in (self.d_in[rows], self.d_out[rows], self.bar)
        )
        share = np.clip((z_bar - z_in) / np.maximum(z_out - z_in, 1e-300), 0.0, 1.0)
        return self.c_in[rows] + share * (self.c_out[rows] - self.c_in[rows])

    def _try(self, going: NDArray, c: NDArray) -> None:
        """Find the profile at c and move inside or outside there."""
        k, before = self.k[going], self.c_in[going]
        start = self.inside[going] + self.drift[going] * (c - before)[:, None]
        start[np.arange(len(going)), k] = c
        held = np.zeros(start.shape, dtype=bool)
        held[np.arange(len(going)), k] = True
        at, loss = descend(self.deviance, start, held)
        good = loss <= self.bar
        won, lost = going[good], going[~good]
        moved = np.where(c == before, 1.0, c - before)[good]
        self.drift[won] = (at[good] - self.inside[won]) / moved[:, None]
        self.step[won] = self._longer(won, c[good], loss[good])
        self.inside[won], self.c_in[won], self.d_in[won] = at[good], c[good], loss[good]
        self.c_out[lost], self.d_out[lost], self.met[lost] = c[~good], loss[~good], True

    def _longer(self, rows: NDArray, c: NDArray, loss: NDArray) -> NDArray:
        """The next step: to where a parabola through the place and c meets the bar."""
        gone = np.abs(c - self.origin[rows])
        risen = np.maximum(loss - self.d_origin[rows], 1e-12)
        reach = gone * np.sqrt(np.maximum(self.bar - self.d_origin[rows], 0.0) / risen)
        return np.clip(_EAGER * reach - gone, 0.02 * gone, _FARTHEST * gone) + 1e-9

    def _ended(self, going: NDArray) -> NDArray[np.bool_]:
        """Which marches have found the bar or the bound."""
        at_bound = self.side[going] * self.c_in[going] >= 1.0
        on_bar = self.bar - self.d_in[going] <= _PRECISE * self.rise
        near = np.abs(self.c_out[going] - self.c_in[going])
        shut = near <= _CLOSE * np.abs(self.c_in[going] - self.origin[going]) + 1e-10
        tight = self.d_out[going] - self.bar <= _PRECISE * self.rise
        return at_bound | on_bar | self.met[going] & (shut | tight)


def _merged(low: NDArray, high: NDArray) -> tuple[tuple[float, float], ...]:
    """Intervals (m,), those that overlap as one, in ascending order."""
    pieces: list[list[float]] = []
    for a, b in sorted(zip(low.tolist(), high.tolist(), strict=True)):
        if pieces and a <= pieces[-1][1] + 1e-9:
            pieces[-1][1] = max(pieces[-1][1], b)
        else:
            pieces.append([a, b])
    return tuple((a, b) for a, b in pieces)
