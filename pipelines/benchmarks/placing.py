"""Where the next sensor goes: the strategies of ``location_finding``.

The unknowns are levels of the coordinates, for a model says of its unknowns that they lie anywhere within
their bounds, and anywhere among the levels is the prior of the task. Estimates are those of ``LeastSquares``,
with its defaults. Agents plan for a vehicle; here it jumps, and an action is a place: some are spread as the
prior is, the others lie on rings about the sources of the estimate, 0.02 to 1 from them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fieldrl.agent.greedy_information import GreedyInformation
from fieldrl.agent.planner import Planner
from fieldrl.agent.planning import Planning
from fieldrl.agent.situation import Situation
from fieldrl.core.domain import Domain
from fieldrl.core.information import sensitivities
from fieldrl.core.samples import Samples
from fieldrl.estimator.designs import additive_recurrence, cover
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission.world import world
from fieldrl.uncertainty import Assessment, assess, design, draws, noise_of
from pipelines.benchmarks.sources import NOISE, UNKNOWNS, Sources, means, places

_RADII, _ANGLES = np.geomspace(0.02, 1.0, 6), np.arange(8) * np.pi / 4  # of the rings
_SPREAD = 128  # places that are spread as the prior is
_DRAWS, _RINGED = 100, 6  # draws, and of how many the sources have rings
_FAR, _CELLS = 4.0, 50  # half the side of a grid, and its cells along it
_NODES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(3)  # of the noise of one sample more

Chooser = Callable[[Samples, int, np.random.Generator], NDArray[np.float64]]
"""From the samples, how many are left, and a generator: where the next one is taken, (2,) [length]."""


@dataclass(frozen=True, eq=False)
class Jumps:
    """A vehicle that reaches any of some places in one step.

    Args:
        places: what its actions are, (c, 2) [length].
    """

    places: NDArray[np.float64]
    time_step: float = 1.0

    def paths(
        self, state: Any, plans: NDArray, time: Any, flow: Any, thetas: NDArray, domain: Any
    ) -> NDArray:
        """The places of plans (K, H), whatever the water does: (M, K, H, 2) [length]."""
        return np.broadcast_to(self.places[plans], (len(thetas), *plans.shape, 2))


def spread(count: int) -> NDArray[np.float64]:
    """Places as dense as the prior, (count, 2) [length]."""
    return places((1.0 + additive_recurrence(count, 2)) / 2.0)


def candidates(thetas: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places to choose from: spread ones, and rings about all sources of levels (m, 4); (c, 2) [length]."""
    ring = np.stack(np.broadcast_arrays(np.cos(_ANGLES), np.sin(_ANGLES)), axis=-1)
    rings = (_RADII[:, None, None] * ring).reshape(-1, 2)
    about = places(thetas).reshape(-1, 1, 2) + rings
    return np.concatenate([spread(_SPREAD), about.reshape(-1, 2)])


class Estimates:
    """What is known from samples, by the estimator for cheap models."""

    def __init__(self) -> None:
        self.model, self.estimator = world(Sources()), LeastSquares()
        self.centre, self.half_width = self.model.parameters.centre, self.model.parameters.half_width

    def of(self, samples: Samples) -> NDArray[np.float64]:
        """Levels (4,); in the middle while there are no samples."""
        return self.estimator.fit(self._problem(samples)).theta[0] if len(samples) else self.centre

    def assessed(self, samples: Samples) -> Assessment:
        """How far the estimate may be trusted, and what else explains the samples."""
        return assess(self._problem(samples), self.of(samples), noise_of(samples, NOISE))

    def drawn(self, samples: Samples) -> NDArray[np.float64]:
        """Levels that explain the samples, each as often as it is likely, (d, 4)."""
        u = draws(self.assessed(samples), _DRAWS) if len(samples) else cover(7, UNKNOWNS)[:_DRAWS]
        return self.centre + self.half_width * u

    def _problem(self, samples: Samples) -> FitProblem:
        return FitProblem(self.model, samples, self.estimator.tikhonov)


def random(_samples: Samples, _left: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """A place of the prior."""
    return rng.standard_normal(2)


def fixed(samples: Samples, left: int, _rng: np.random.Generator) -> NDArray[np.float64]:
    """The next place of a design that is spread as the prior is."""
    return spread(len(samples) + left)[len(samples)]


def by(agent: Planning) -> Chooser:
    """What a planning agent chooses among the candidates."""
    estimates = Estimates()

    def choose(samples: Samples, left: int, rng: np.random.Generator) -> NDArray[np.float64]:
        theta = estimates.of(samples)
        where, nowhere = candidates(theta[None]), np.zeros(3)
        unknown, now = np.full(UNKNOWNS, np.nan), float(len(samples))
        known = (samples, theta, unknown, NOISE, nowhere, now, left)
        state = agent.begin(np.empty(0), np.empty(0), len(where))
        return where[agent.plan(state, Situation(estimates.model, Jumps(where), *known), rng)]

    return choose


def by_suggestion() -> Chooser:
    """The best of a grid by the rule of ``fieldrl suggest``."""
    estimates, grid = Estimates(), Domain((-_FAR, -_FAR), (_FAR, _FAR)).grid(_CELLS, _CELLS).points

    def choose(samples: Samples, _left: int, _rng: np.random.Generator) -> NDArray[np.float64]:
        theta, sites = estimates.of(samples), np.concatenate([samples.positions, grid])
        slopes = sensitivities(estimates.model, theta, sites, np.zeros(len(sites)), NOISE)
        before, after = np.split(slopes, [len(samples)])
        return grid[design.greedy(before.T @ before, after, 1)[0][0]]

    return choose


def by_expectation() -> Chooser:
    """The candidate whose sample is expected to tell most, over draws of what explains the samples."""
    estimates = Estimates()

    def choose(samples: Samples, _left: int, _rng: np.random.Generator) -> NDArray[np.float64]:
        drawn = estimates.drawn(samples)
        where = candidates(drawn[:: math.ceil(len(drawn) / _RINGED)])
        return where[int(np.argmax(expected_information(means(places(drawn), where))))]

    return choose


def expected_information(mu: NDArray[np.float64]) -> NDArray[np.float64]:
    """Information of one sample more at each candidate, from predictions (d, c) by equally likely draws:
    nested Monte Carlo with the noise by quadrature, (c,) [nat]."""
    return _expected_information(np.ascontiguousarray(mu.T / NOISE), _NODES, _WEIGHTS / _WEIGHTS.sum())


@njit(cache=True, error_model="numpy")
def _expected_information(mu, nodes, weights):
    found = np.zeros(len(mu))
    for c in range(len(mu)):
        for own in mu[c]:
            for node, weight in zip(nodes, weights):  # noqa: B905 - numba has no strict
                density = 0.0
                for other in mu[c]:
                    density += math.exp(-0.5 * (own + node - other) ** 2)
                found[c] -= weight * (math.log(density / mu.shape[1]) + 0.5 * node * node)
    return found / mu.shape[1]


STRATEGIES: dict[str, Callable[[], Chooser]] = {
    "random": lambda: random,
    "spread": lambda: fixed,
    "greedy_information": lambda: by(GreedyInformation()),
    "suggest": by_suggestion,
    "planner": lambda: by(Planner(horizon=1, population=512)),
    "expected_information": by_expectation,
}
