"""True fields that the fitted model is wrong about, to see whether it is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from fieldrl.pde.source import LocalisedSource
from pipelines.calibration.missions import Simulated, World, with_truth

Scenario = Callable[[World, Simulated], NDArray[np.float64]]


def wrong_source(world: World, simulated: Simulated) -> NDArray[np.float64]:
    """Values where a source feeds the field that the model knows nothing of."""
    source = LocalisedSource(strength=5.0, centre=(80.0, 80.0), width=10.0)
    return simulated.field_of(with_truth(world.water, simulated.truth, true_model={"source": source}))


def wrong_diffusivity(world: World, simulated: Simulated) -> NDArray[np.float64]:
    """Values where the field spreads five times as fast as the model has it."""
    rho = 5.0 * world.water.diffusivity  # pyright: ignore[reportAttributeAccessIssue]
    return simulated.field_of(with_truth(world.water, simulated.truth, true_model={"diffusivity": rho}))


def outlier(world: World, simulated: Simulated) -> NDArray[np.float64]:
    """Values one of which, the seventh, is six standard deviations off."""
    values = simulated.clean.copy()
    values[6] += 6.0 * world.noise
    return values


WRONG: Mapping[str, Mapping[str, Scenario]] = {
    "advection": {"source": wrong_source, "outlier": outlier},
    "double_gyre": {"diffusivity": wrong_diffusivity, "outlier": outlier},
}
"""By experiment, what the model does not know of the true field; noise comes on top."""

WRONG_EVERY = {"advection": 1, "double_gyre": 3}
"""Every mission of advection is tried with them, every third of the gyres: a true field of theirs is dear."""
