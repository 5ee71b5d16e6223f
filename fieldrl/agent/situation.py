"""What a planning agent knows when it decides: the model, the samples, the estimate, and its own motion.

| symbol | meaning | shape | unit |
|---|---|---|---|
| plans | actions of K plans over H steps | (K, H) | |
| thetas | M parameters that a plan is judged by | (M, p) | each its own |
| F | Fisher information of all samples, planned ones too, see ``core/information.py`` | (M, K, p, p) | 1 |
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import information
from fieldrl.core.samples import Samples


@dataclass(frozen=True, eq=False)
class Situation:
    """Before a decision.

    Args:
        model: the forward model, with its flow and domain.
        vehicle: how it moves.
        samples: all samples so far.
        theta: the estimate, (p,); the centre of the bounds before the first sample.
        truth: the true parameters, (p,): for the oracle alone.
        noise: standard deviation of a sample's noise > 0 [field unit].
        state: measured x, y, heading, (3,) [length, length, rad].
        time: now [time].
        left: samples that may still be taken.
    """

    model: Any
    vehicle: Any
    samples: Samples
    theta: NDArray[np.float64]
    truth: NDArray[np.float64]
    noise: float
    state: NDArray[np.float64]
    time: float
    left: int

    def paths(
        self, plans: NDArray[np.int64], thetas: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where plans lead in the flow of each theta, (M, K, H, 2) [length], and when, (H,) [time]."""
        model, step = self.model, self.vehicle.time_step
        own = [model.flow_parameters(t) if hasattr(model, "flow_parameters") else t for t in thetas]
        states = self.vehicle.paths(self.state, plans, self.time, model.flow, np.array(own), model.domain)
        times = (len(self.samples) + 1 + np.arange(plans.shape[1])) * step
        return states[..., :2], times

    def information(self, plans: NDArray[np.int64], thetas: NDArray[np.float64]) -> NDArray[np.float64]:
        """F after each plan, were theta true, (M, K, p, p)."""
        positions, times = self.paths(plans, thetas)
        return np.stack([self._information(*one, times) for one in zip(thetas, positions, strict=True)])

    def _information(
        self, theta: NDArray, positions: NDArray[np.float64], times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """F after each plan (K, p, p), of the samples and of planned positions (K, H, 2)."""
        plans, horizon, _ = positions.shape
        n = len(self.samples)
        at = np.concatenate([self.samples.positions, self.model.admissible(positions.reshape(-1, 2))])
        when = np.concatenate([self.samples.times, np.tile(times, plans)])
        slopes = information.sensitivities(self.model, theta, at, when, self.noise)
        planned = slopes[n:].reshape(plans, horizon, len(theta))
        return information.fisher(slopes[:n]) + np.swapaxes(planned, 1, 2) @ planned
