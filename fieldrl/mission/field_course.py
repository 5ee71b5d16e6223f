"""The true field while an episode samples it: what paths are to be seen over."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.domain import Grid
from fieldrl.mission.environment import Truth

MOMENTS = 24
"""Most times at which the field is kept."""

_CELLS = 72  # along the longer side of the domain, about: enough for a picture


def field_course(truth: Truth, theta: NDArray[np.float64], times: NDArray[np.float64]) -> dict[str, Any]:
    """Record variables: the true field at the times of the samples, coarsely, for pictures.

    Args:
        truth: the model that generates it.
        theta: its parameters, (p,).
        times: of an episode's samples, (steps,) [time]; where there are many, some are chosen evenly.

    Returns:
        ``field_course`` (moment, course_x, course_y) [field unit], and what its dimensions mean.
    """
    chosen = np.unique(np.linspace(0, len(times) - 1, min(len(times), MOMENTS)).round().astype(np.int64))
    grid = _thinned(truth.grid)
    fields = [truth.field(theta, float(times[step]), grid) for step in chosen]
    about = {"units": "field unit", "long_name": "true field at the times of samples, for pictures"}
    return {
        "field_course": (("moment", "course_x", "course_y"), np.array(fields, dtype=np.float32), about),
        "course_step": (("moment",), chosen, {"units": "1", "long_name": "index of the sample"}),
        "course_x": (("course_x",), grid.x, {"units": "length", "long_name": "x"}),
        "course_y": (("course_y",), grid.y, {"units": "length", "long_name": "y"}),
    }


def _thinned(grid: Grid) -> Grid:
    stride = max(1, -(-max(grid.x.size, grid.y.size) // _CELLS))
    return Grid(grid.x[::stride], grid.y[::stride])
