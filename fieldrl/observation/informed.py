"""What the vehicle knows: its own state, the newest value, the estimate, and where the feature should be.

| place | variable | unit |
|---|---|---|
| 0-3 | x, y, heading, time, as measured | length, length, rad, time |
| 4 | value, the newest; 0 before the first | field unit |
| 5 | uncertainty, log10 sqrt(tr F^-1 / p), see ``core/information.py``; 0: the bounds alone are known | 1 |
| 6, 7 | plume_x, plume_y: from the vehicle to the predicted feature | length |
| 8, 9 | plume_distance, and plume_bearing, counter-clockwise from the vehicle's heading | length, rad |
| 10, 11, ... | estimate_1, deviation_1, estimate_2, ...: estimate and its standard deviation, (*) | 1 |

(*) In half-widths of the bounds, the estimate from their centre. The predicted feature is where the flow of
the estimate carries its centre until now.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import information
from fieldrl.core.kinds import component
from fieldrl.observation.knowledge import Known
from fieldrl.pde.tracer import predicted_place

_SMALLEST = -6.0  # log10 of an uncertainty that is told apart


@component
class Informed:
    """Everything that is known, as numbers."""

    needs_feature: ClassVar[bool] = True

    def bounds(
        self, low: NDArray[np.float64], high: NDArray[np.float64], model: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds of all variables, (10 + 2 p,); the value's are twice the feature's amplitude."""
        reach = high[:2] - low[:2]
        value, across = 2 * abs(model.initial.amplitude), math.hypot(*reach)
        p = len(model.parameters)
        least = [-value, _SMALLEST, *-reach, 0.0, -math.pi, *[-1.0, 0.0] * p]
        most = [value, 0.0, *reach, across, math.pi, *[1.0, 1.0] * p]
        return np.concatenate([low, least]), np.concatenate([high, most])

    def see(self, own: NDArray[np.float64], known: Known) -> NDArray[np.float64]:
        """The observation, (10 + 2 p,)."""
        parameters, samples = known.model.parameters, known.samples
        variances, value = np.eye(len(parameters)), 0.0
        if len(samples):
            where = samples.positions, samples.times
            slopes = information.sensitivities(known.model, known.theta, *where, known.noise or 1.0)
            variances, value = np.linalg.inv(information.fisher(slopes)), samples.values[-1]
        plume = predicted_place(known.model, known.theta, own[3]) - own[:2]
        bearing = math.remainder(math.atan2(plume[1], plume[0]) - own[2], 2 * math.pi)
        deviations = np.sqrt(np.diag(variances))
        uncertainty = max(0.5 * math.log10(np.trace(variances) / len(parameters)), _SMALLEST)
        estimate = (known.theta - parameters.centre) / parameters.half_width
        told = np.column_stack([estimate, deviations]).ravel()
        seen = [value, uncertainty, *plume, math.hypot(*plume), bearing]
        return np.concatenate([own, seen, told])
