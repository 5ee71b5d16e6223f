"""What is true in an episode: an option of the group ``scenario`` is a file here."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import numpy as np


class Scenario(Protocol):
    """What decides on the truth of every episode."""

    varies: ClassVar[bool]
    """Whether episodes differ in it."""

    def draw(self, water: Any, rng: np.random.Generator) -> Any:
        """The water of an episode, with its true parameters."""
        ...
