"""The observation of the paper: measured x, y and heading, and the time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.kinds import component
from fieldrl.observation.knowledge import Known, KnownMany


@component
class Paper:
    """Nothing but the own state."""

    def bounds(
        self, low: NDArray[np.float64], high: NDArray[np.float64], model: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The same bounds."""
        return low, high

    def see(self, own: NDArray[np.float64], known: Known) -> NDArray[np.float64]:
        """The same four."""
        return own

    def see_many(self, own: NDArray[np.float64], known: KnownMany) -> NDArray[np.float64]:
        """The same four of each, (B, 4)."""
        return own
