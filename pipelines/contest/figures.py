"""Pictures of the contest's table."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fieldrl.figures import style
from pipelines.contest.statistics import performance_profile

_THRESHOLDS = np.geomspace(1e-3, 10.0, 200)


def profiles(errors: Mapping[str, NDArray[np.float64]]) -> Figure:
    """The share of missions whose error is at most a value, by agent.

    Args:
        errors: parameter errors of each agent, (places, seeds) [length/time].
    """
    drawing = style.figure(5.0, 3.2)
    axes = drawing.subplots()
    style.dress(axes)
    for number, (agent, scores) in enumerate(errors.items()):
        line = "-" if number < 7 else "--"
        axes.plot(_THRESHOLDS, performance_profile(scores, _THRESHOLDS), line, label=agent)
    axes.set_xscale("log")
    style.label(axes, "Error of the flow [length/time]", "Share of missions")
    axes.legend(fontsize=6, frameon=False)
    return drawing
