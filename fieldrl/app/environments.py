"""What ``gymnasium.make("fieldrl/Advection-v0")`` builds: the environment that a configuration describes."""

from __future__ import annotations

from collections.abc import Sequence

from fieldrl.app.compose import composed
from fieldrl.app.setup import mission
from fieldrl.mission.environment import FieldSampling


def make_environment(experiment: str, overrides: Sequence[str] = ()) -> FieldSampling:
    """The environment of an experiment.

    Args:
        experiment: an option of the group ``experiment``.
        overrides: as on the command line, e.g. ``["vehicle.max_speed=5", "estimator.starts=1"]``.
    """
    return mission(composed([f"experiment={experiment}", *overrides])).environment()
