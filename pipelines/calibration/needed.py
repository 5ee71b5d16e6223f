"""Samples that a mission needs until every interval is narrow enough, and whether the intervals hold then.

A mission that stops when its intervals are narrow chooses when to look at them; coverage at the stop says
whether that does them harm.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fieldrl.estimator.problem import FitProblem
from fieldrl.uncertainty import Noise, assess
from pipelines.calibration.cases import holds
from pipelines.calibration.missions import SIZES, World

WIDTHS = (2.0, 1.0, 0.5, 0.25)
"""Of the intervals of 95 %, at which a mission stops [length/time]; the bounds are 30 apart."""


def judge(world: World, number: int) -> list[dict[str, Any]]:
    """Mission ``number``: after each sample the widest interval, and whether all hold their truth."""
    simulated, widest, held = world.drawn(number), [], []
    known = np.empty((0, len(world.water.parameters)))
    for n in range(1, SIZES[-1] + 1):
        samples, noise = simulated.samples(n), Noise(np.full(n, world.noise), True)
        problem = FitProblem(simulated.water, samples, world.mission.estimator.tikhonov, False, known)
        fit = world.mission.estimator.fit(problem)
        found = assess(problem, fit.theta[0], noise, fit.known, paths=simulated.paths[:n])
        widest.append(float(np.diff(found.interval, axis=1).max()))
        held.append(holds(found, simulated.truth))
    return [{"mission": number, "widest": widest, "held": held}]
