"""What an observation is made of."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

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


class Observation(Protocol):
    """What the agent sees beyond its own measured state."""

    def bounds(
        self, low: NDArray[np.float64], high: NDArray[np.float64], model: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest observation, (k,), from those of x, y, heading and time, (4,)."""
        ...

    def see(self, own: NDArray[np.float64], known: Known) -> NDArray[np.float64]:
        """The observation (k,), from measured x, y, heading and time (4,); may lie beyond the bounds."""
        ...
