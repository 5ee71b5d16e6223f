"""Another truth in every episode: only a policy that generalises succeeds.

The true parameters are drawn uniformly between ``lower`` and ``upper``. The place of the feature may be drawn
too; the model is told of it, as one is told where a spill began but not where it drifts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import OR_NULL, component


@component
class Drawn:
    """Truths from boxes.

    Args:
        lower: least true parameters, (p,); None: the lower bounds of the estimate.
        upper: greatest true parameters, (p,); None: the upper bounds of the estimate.
        place: corners (x, y) of the box that the feature's centre is drawn from, (2, 2); None: it stays where
            ``pde.initial.centre`` says [length].
    """

    lower: Annotated[Sequence[float], OR_NULL] = None  # type: ignore
    upper: Annotated[Sequence[float], OR_NULL] = None  # type: ignore[assignment]
    place: Annotated[Sequence[Sequence[float]], OR_NULL] = None  # type: ignore[assignment]

    varies: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for name in ("lower", "upper"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checks.vector(name, getattr(self, name), None))
        if self.place is not None:
            corners = tuple(checks.vector("place", corner, 2, "length") for corner in self.place)
            if len(corners) != 2 or not np.all(np.less_equal(*corners)):
                rule = "must be two corners, [[x, y], [x, y]], the least first"
                raise checks.InvalidValue("place", self.place, rule, "length")
            object.__setattr__(self, "place", corners)

    def draw(self, water: Any, rng: np.random.Generator) -> Any:
        """The water of an episode; draws p numbers, and two for the place.

        Raises:
            InvalidValue: lower and upper do not fit to the bounds of the water's parameters.
        """
        low, high = self._box(water)
        true = rng.uniform(low, high)
        if self.place is None and hasattr(water, "with_truth"):  # it spares the checks
            return water.with_truth(true)
        changed = _with_truth(water, true)
        if self.place is None:
            return replace(water, **changed)
        if hasattr(water, "prepare"):
            rule = "would need another model in every episode, which takes long to build"
            raise checks.InvalidValue("place", self.place, rule, remedy="leave it null, or use a full model")
        low, high = self.place
        centre = rng.uniform(low, high)
        return replace(water, **changed, initial=replace(water.initial, centre=centre.tolist()))

    def _box(self, water: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        parameters = water.parameters
        bounds = np.asarray(parameters.lower), np.asarray(parameters.upper)
        low = bounds[0] if self.lower is None else np.asarray(self.lower)
        high = bounds[1] if self.upper is None else np.asarray(self.upper)
        for name, box in (("lower", low), ("upper", high)):
            if box.shape != bounds[0].shape or np.any(box < bounds[0]) or np.any(box > bounds[1]):
                rule = f"must be {len(parameters)} numbers within the bounds of {', '.join(parameters.names)}"
                raise checks.InvalidValue(name, box, rule)
        if np.any(low > high):
            raise checks.InvalidValue("upper", high, f"must not be below lower={low.tolist()}")
        return low, high


def _with_truth(water: Any, true: NDArray[np.float64]) -> dict[str, Any]:
    """What makes ``true`` (p,) the true parameters of a model."""
    unknown = getattr(water, "unknown", None)
    if not isinstance(unknown, Mapping):
        return {"true": tuple(true.tolist())}
    values = dict(zip(water.parameters.names, true.tolist(), strict=True))
    return {"unknown": {name: {**about, "true": values[name]} for name, about in unknown.items()}}
