"""Stop when sure: an episode ends when the intervals are as narrow as is wanted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.parameters import Parameters
from fieldrl.estimator.problem import Fit, FitProblem
from fieldrl.mission.environment import Sensor
from fieldrl.uncertainty import assess, noise_of


def widths(stop: Mapping[str, float], parameters: Parameters) -> NDArray[np.float64]:
    """Widths that the intervals of the unknowns must be below, (p,); infinite where none is stated.

    Raises:
        InvalidValue: an unknown of another name, or a width that is not positive.
    """
    for name, width in stop.items():
        if name not in parameters.names:
            known = ", ".join(parameters.names)
            raise checks.InvalidValue(f"stop.{name}", width, "is no unknown", remedy=f"they are {known}")
        unit = parameters.units[parameters.names.index(name)]
        checks.positive(f"stop.{name}", width, unit)
    return np.array([float(stop.get(name, np.inf)) for name in parameters.names])


def stated_noise(sensor: Sensor) -> float | None:
    """The sensor's noise; not known where positions are measured with noise as well [field unit]."""
    return None if any(getattr(sensor, "covariance", ())) else sensor.noise


def sure(problem: FitProblem, fit: Fit, sensor: Sensor, widths: NDArray[np.float64]) -> bool:
    """Whether every interval of 95 % is narrower than its width; costs a dear model no solve.

    Args:
        problem: the samples so far.
        fit: of them.
        sensor: that took them.
        widths: of the intervals, (p,), see ``widths``.
    """
    noise, alone = noise_of(problem.samples, stated_noise(sensor)), replace(problem, leave_one_out=False)
    found = assess(alone, fit.theta[0], noise, fit.known)
    return bool(np.all(np.diff(found.interval, axis=1)[:, 0] < widths))
