"""Gymnasium's registry: ``gymnasium.make("fieldrl/Advection-v0")`` builds what the configuration says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import gymnasium

if TYPE_CHECKING:
    from fieldrl.mission.environment import FieldSampling

_EXPERIMENTS = {"fieldrl/Advection-v0": "advection", "fieldrl/DoubleGyre-v0": "double_gyre"}


def register() -> None:
    """Register the environments; Gymnasium calls this through the entry point of the package."""
    for name, experiment in _EXPERIMENTS.items():
        gymnasium.register(
            name, "fieldrl.app.environments:make_environment", kwargs={"experiment": experiment}
        )


def make_environment(experiment: str, overrides: Sequence[str] = ()) -> FieldSampling:
    """The environment of an experiment.

    Args:
        experiment: an option of the group ``experiment``.
        overrides: as on the command line, e.g. ``["vehicle.max_speed=5", "estimator.starts=1"]``.
    """
    from fieldrl.app.compose import composed
    from fieldrl.app.setup import mission

    return mission(composed([f"experiment={experiment}", *overrides])).environment()
