"""The same truth in every episode, as the configuration says: what the paper does."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from fieldrl.core.kinds import component


@component
class Fixed:
    """Draws nothing."""

    varies: ClassVar[bool] = False

    def draw(self, water: Any, rng: np.random.Generator) -> Any:
        """The water itself."""
        return water
