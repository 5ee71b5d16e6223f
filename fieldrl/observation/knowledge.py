"""What an observation is made of."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples


class Known(NamedTuple):
    """What the vehicle knows after a sample: no truth.

    Args:
        model: the forward model, with its flow and initial feature.
        samples: all samples so far.
        theta: the estimate, (p,); the centre of the bounds before the first sample.
        noise: standard deviation of a sample's noise [field unit].
    """

    model: Any
    samples: Samples
    theta: NDArray[np.float64]
    noise: float


class KnownMany(NamedTuple):
    """``Known`` of B missions, as an observation with a method ``see_many`` wants it.

    Args:
        parameters: the unknowns.
        values: the newest, (B,); 0 before the first [field unit].
        slopes: derivatives of all predictions by the unknowns in half-widths, (B, n, p) [field unit].
        theta: the estimates, (B, p).
        plumes: where each flow has carried the centre of the initial feature by now, (B, 2) [length].
        scale: of the initial feature [length].
        noise: standard deviation of a sample's noise [field unit].
    """

    parameters: Parameters
    values: NDArray[np.float64]
    slopes: NDArray[np.float64]
    theta: NDArray[np.float64]
    plumes: NDArray[np.float64]
    scale: float
    noise: float


class Observation(Protocol):
    """What the agent sees beyond its own measured state.

    With a method ``see_many`` of own states (B, 4) and ``KnownMany`` it serves compiled batches as well.
    """

    def bounds(
        self, low: NDArray[np.float64], high: NDArray[np.float64], model: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest observation, (k,), from those of x, y, heading and time, (4,)."""
        ...

    def see(self, own: NDArray[np.float64], known: Known) -> NDArray[np.float64]:
        """The observation (k,), from measured x, y, heading and time (4,); may lie beyond the bounds."""
        ...
