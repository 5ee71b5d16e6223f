"""A receding-horizon planner: before every step it plans the rest of the mission, and takes the first action.

A plan is worth what error it leaves, expected over what the truth may be given the samples:

    mean over particles theta of sqrt(tr F(theta)^-1 / p)

The particles are drawn from the posterior (uniform prior within the bounds, normal noise) by importance
resampling, from half prior, half normal proposals around the estimate.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent.fixed import State
from fieldrl.agent.planning import Planning, cross_entropy, expected_error, uniform
from fieldrl.agent.situation import Situation
from fieldrl.core import checks, information
from fieldrl.core.kinds import component


@component
class Planner(Planning):
    """Cross-entropy over plans, on particles of the posterior.

    A model without derivatives is dear: there the estimate is the only particle.

    Args:
        particles: M >= 1.
        population: plans of an iteration of the cross-entropy method, >= 8.
        iterations: of it, >= 1.
        horizon: steps that are planned at most, >= 1.
        proposals: drawn for the particles, >= 2.
    """

    particles: int = 16
    population: int = 64
    iterations: int = 4
    horizon: int = 20
    proposals: int = 2000

    def __post_init__(self) -> None:
        checks.integer("particles", self.particles, 1)
        checks.integer("population", self.population, 8)
        checks.integer("iterations", self.iterations, 1)
        checks.integer("horizon", self.horizon, 1)
        checks.integer("proposals", self.proposals, 2)

    def plan(self, state: State, situation: Situation, rng: np.random.Generator) -> int:
        """The first action of the best plan."""
        thetas = self._particles(situation, rng)
        horizon, actions = min(self.horizon, situation.left), state["actions"].item()
        best = cross_entropy(
            lambda plans: expected_error(situation, plans, thetas),
            uniform(horizon, actions),
            rng,
            self.population,
            self.iterations,
            self._before(state, situation, horizon),
        )
        state["plan"], state["made"] = best, np.array([len(situation.samples)])
        return int(best[0])

    def _before(self, state: State, situation: Situation, horizon: int) -> NDArray[np.int64] | None:
        """What is left of the last plan, its last action repeated, (H,); None at an episode's start."""
        if "plan" not in state or state["made"].item() != len(situation.samples) - 1:
            return None
        rest = state["plan"][1 : horizon + 1]
        return np.pad(rest, (0, horizon - len(rest)), mode="edge") if len(rest) else None

    def _particles(self, situation: Situation, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draws from the posterior, (M, p)."""
        model, samples = situation.model, situation.samples
        if not hasattr(model, "jacobian"):
            return situation.theta[None]
        centre, half_width = model.parameters.centre, model.parameters.half_width
        if not len(samples):
            return centre + half_width * rng.uniform(-1, 1, (self.particles, len(centre)))
        u, weight = self._proposals(situation, rng)
        thetas = centre + half_width * u
        residuals = (
            model.predict(thetas, samples.positions, samples.times) - samples.values
        ) / situation.noise
        log = -0.5 * np.sum(residuals**2, axis=1)
        weight = np.exp(log - log.max()) * weight
        at = np.cumsum(weight) / weight.sum()
        places = (rng.random() + np.arange(self.particles)) / self.particles
        return thetas[np.minimum(np.searchsorted(at, places), len(u) - 1)]

    def _proposals(
        self, situation: Situation, rng: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Proposals u within the bounds, (m, p) [half-width], and prior / proposal density of each, (m,)."""
        model, samples = situation.model, situation.samples
        where = samples.positions, samples.times
        slopes = information.sensitivities(model, situation.theta, *where, situation.noise)
        known = information.fisher(slopes)
        estimate = (situation.theta - model.parameters.centre) / model.parameters.half_width
        half, p = self.proposals // 2, len(estimate)
        root = np.linalg.cholesky(np.linalg.inv(known))
        near = estimate + rng.standard_normal((half, p)) @ root.T
        u = np.concatenate([rng.uniform(-1, 1, (self.proposals - half, p)), near])
        u = u[np.all(np.abs(u) <= 1, axis=1)]
        away = u - estimate
        squared = np.einsum("mi,ij,mj->m", away, known, away)
        normal = np.sqrt(np.linalg.det(known)) * (2 * np.pi) ** (-p / 2) * np.exp(-0.5 * squared)
        prior = 0.5**p
        return u, prior / (0.5 * prior + 0.5 * normal)
