"""What the vehicle sees: its own state through Eq. (14), the field through a noisy probe.

| symbol | meaning | shape | unit |
|---|---|---|---|
| sigma | standard deviation of a sample's noise | scalar | field unit |
| Sigma | diagonal of the covariance of the observed state | (3,) | length^2, length^2, rad^2 |
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component


@component
class Sensor:
    """A probe with noise N(0, sigma^2), and the state with noise N(0, Sigma), Eq. (14).

    Args:
        noise: sigma >= 0 [field unit].
        covariance: variances of x, y and heading, the diagonal of Sigma, each >= 0, (3,).
    """

    noise: float = 1.0
    covariance: Sequence[float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "noise", checks.not_negative("noise", self.noise, "field unit"))
        variances = checks.vector("covariance", self.covariance, 3, "length^2, length^2, rad^2")
        if min(variances) < 0:
            rule = "must hold variances >= 0 of x, y and heading"
            raise checks.InvalidValue("covariance", self.covariance, rule, "length^2, length^2, rad^2")
        object.__setattr__(self, "covariance", variances)

    @cached_property
    def _deviations(self) -> NDArray[np.float64] | None:
        return np.sqrt(self.covariance) if any(self.covariance) else None

    def observe(self, state: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
        """The measured state z = x + r, Eq. (14).

        It may lie outside the domain or the heading limits. Where Sigma is 0 it is ``state`` itself
        and nothing is drawn; else three normal numbers are.

        Args:
            state: true x, y, heading, (3,) [length, length, rad].
            rng: the stream of the sensor.

        Returns:
            (3,) [length, length, rad].
        """
        if self._deviations is None:
            return state
        return state + self._deviations * rng.standard_normal(3)

    def measure(self, value: float, rng: np.random.Generator) -> float:
        """A sample of the field: ``value`` + N(0, sigma^2) [field unit]; draws nothing where sigma is 0."""
        return float(value + self.noise * rng.standard_normal()) if self.noise else float(value)
