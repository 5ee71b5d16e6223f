"""Samples must lie in the water and in the time that is solved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.domain import Domain


class OutsideDomain(checks.InvalidValue):
    """A sample outside the water, or outside the time that is solved."""


def check_inside(positions: NDArray, times: NDArray, domain: Domain, final_time: float) -> None:
    """Raise OutsideDomain for a position (n, 2) outside ``domain`` or a time (n,) outside [0, final_time]."""
    low, high = domain.lower, domain.upper
    outside = ~np.all((positions >= low) & (positions <= high), axis=1)
    if outside.any():
        rule = f"must lie in the domain {list(low)} to {list(high)}"
        raise OutsideDomain("positions", positions[outside][0], rule, "length")
    late = ~((times >= 0) & (times <= final_time * (1 + 1e-12)))
    if late.any():
        rule = f"must lie in [0, {final_time:g}]"
        raise OutsideDomain("times", float(times[late][0]), rule, "time", "raise pde.final_time")
