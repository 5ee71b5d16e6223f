"""A receding-horizon planner by hindsight optimisation: before every step it plans the rest of the mission.

The truth may be any of some particles. For each of them the best plan is sought, as if it were known, and an
action is worth what error such plans leave if they begin with it:

    Q(a) = mean over particles theta of the least over plans that begin with a of sqrt(tr F(theta)^-1 / p)

So the action is chosen that serves all particles, given that the way after it is chosen when more is known
(hindsight optimisation, Chong, Givan & Chang 2000; of a partly observed process, QMDP, Littman, Cassandra &
Kaelbling 1995). It supposes that everything is known then: a way that only serves to tell particles apart is
worth nothing. One plan for all particles would suppose that nothing more is ever known.

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
    """Hindsight optimisation, with plans by the cross-entropy method and particles of the posterior.

    A model without derivatives is dear: there the estimate is the only particle.

    Args:
        particles: M >= 1.
        population: plans of an iteration of the cross-entropy method, for each particle, >= 8.
        iterations: of it, >= 1.
        horizon: steps that are planned at most, >= 1; None: the rest of the mission.
        proposals: drawn for the particles, >= 2.
    """

    particles: int = 16
    population: int = 64
    iterations: int = 4
    horizon: int | None = None
    proposals: int = 2000

    def __post_init__(self) -> None:
        checks.integer("particles", self.particles, 1)
        checks.integer("population", self.population, 8)
        checks.integer("iterations", self.iterations, 1)
        if self.horizon is not None:
            checks.integer("horizon", self.horizon, 1)
        checks.integer("proposals", self.proposals, 2)

    def plan(self, state: State, situation: Situation, rng: np.random.Generator) -> int:
        """The action of the least Q."""
        thetas, actions = self._particles(situation, rng), state["actions"].item()
        best = np.array([self._best(situation, theta, actions, rng) for theta in thetas])
        plans = np.unique(_with_each_action_first(best, actions), axis=0)
        left = information.uncertainty(situation.information(plans, thetas))
        worth = [left[:, plans[:, 0] == action].min(axis=1).mean() for action in range(actions)]
        return int(np.argmin(worth))

    def _best(
        self, situation: Situation, theta: NDArray[np.float64], actions: int, rng: np.random.Generator
    ) -> NDArray[np.int64]:
        """The best plan found, were theta (p,) true, (H,)."""
        return cross_entropy(
            lambda plans: expected_error(situation, plans, theta[None]),
            uniform(min(self.horizon or situation.left, situation.left), actions),
            rng,
            self.population,
            self.iterations,
        )

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


def _with_each_action_first(plans: NDArray[np.int64], actions: int) -> NDArray[np.int64]:
    """Plans (K, H) with each action in the place of their first, (K * actions, H)."""
    changed = np.repeat(plans, actions, axis=0)
    changed[:, 0] = np.tile(np.arange(actions), len(plans))
    return changed
