"""What the vehicle knows: its own state, the newest value, the estimate, and where the feature should be.

| place | variable | unit |
|---|---|---|
| 0-3 | x, y, heading, time, as measured | length, length, rad, time |
| 4 | value, the newest; 0 before the first | field unit |
| 5 | uncertainty, log10 sqrt(tr F^-1 / p), see ``core/information.py``; 0: the bounds alone are known | 1 |
| 6, 7 | plume_x, plume_y: from the vehicle to the predicted feature | length |
| 8, 9 | plume_distance, and plume_bearing, counter-clockwise from the vehicle's heading | length, rad |
| 10 | plume_nearness, scale / (scale + plume_distance), with the scale of the initial feature | 1 |
| 11, 12, ... | estimate_1, deviation_1, estimate_2, ...: estimate and its standard deviation, (*) | 1 |

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
from fieldrl.observation.knowledge import Known, KnownMany
from fieldrl.pde.tracer import predicted_place

_SMALLEST = -6.0  # log10 of an uncertainty that is told apart


@component
class Informed:
    """Everything that is known, as numbers."""

    needs_feature: ClassVar[bool] = True

    def bounds(
        self, low: NDArray[np.float64], high: NDArray[np.float64], model: Any
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds of all variables, (11 + 2 p,); the value's are twice the feature's amplitude."""
        reach = high[:2] - low[:2]
        value, across = 2 * abs(model.initial.amplitude), math.hypot(*reach)
        p = len(model.parameters)
        least = [-value, _SMALLEST, *-reach, 0.0, -math.pi, 0.0, *[-1.0, 0.0] * p]
        most = [value, 0.0, *reach, across, math.pi, 1.0, *[1.0, 1.0] * p]
        return np.concatenate([low, least]), np.concatenate([high, most])

    def see(self, own: NDArray[np.float64], known: Known) -> NDArray[np.float64]:
        """The observation, (11 + 2 p,)."""
        model, samples, half_width = known.model, known.samples, known.model.parameters.half_width
        slopes, value = np.empty((0, len(half_width))), 0.0
        if len(samples):
            slopes = information.slopes(model, known.theta, samples.positions, samples.times)
            value = samples.values[-1]
        plume = predicted_place(model, known.theta, own[3])
        parts = np.array([value]), slopes[None], known.theta[None], plume[None], model.initial.scale
        return self.see_many(own[None], KnownMany(model.parameters, *parts, known.noise))[0]

    def see_many(self, own: NDArray[np.float64], known: KnownMany) -> NDArray[np.float64]:
        """The observations of many missions, (B, 11 + 2 p)."""
        parameters, p = known.parameters, len(known.parameters)
        variances = np.linalg.inv(information.fisher(known.slopes / (known.noise or 1.0)))
        traces = np.trace(variances, axis1=-2, axis2=-1)
        uncertainties = [max(0.5 * math.log10(trace / p), _SMALLEST) for trace in traces.tolist()]
        plumes = known.plumes - own[:, :2]
        seen = np.empty((len(own), 11 + 2 * p))
        seen[:, :4], seen[:, 4], seen[:, 5], seen[:, 6:8] = own, known.values, uncertainties, plumes
        seen[:, 8] = [math.hypot(x, y) for x, y in plumes.tolist()]
        ways = zip(plumes.tolist(), own[:, 2].tolist(), strict=True)
        seen[:, 9] = [math.remainder(math.atan2(y, x) - heading, 2 * math.pi) for (x, y), heading in ways]
        seen[:, 10] = known.scale / (known.scale + seen[:, 8])
        seen[:, 11::2] = (known.theta - parameters.centre) / parameters.half_width
        seen[:, 12::2] = np.sqrt(np.diagonal(variances, axis1=-2, axis2=-1))
        return seen
