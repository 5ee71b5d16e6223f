"""A small mission of the first experiment, with any part of it changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from fieldrl.agent.sarsa_lambda import SarsaLambda
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.mission import Mission
from fieldrl.pde.advection import Advection
from fieldrl.reward.total_error import TotalError
from fieldrl.vehicle.unicycle import Unicycle


def small(**changed: Any) -> Mission:
    """The mission, with some parts changed."""
    parts = {
        "water": Advection(),
        "vehicle": Unicycle(),
        "agent": SarsaLambda(),
        "estimator": LeastSquares(),
        "reward": TotalError(),
        "episodes": 3,
        "steps": 4,
        "evaluation_episodes": 2,
    }
    return Mission(**parts | changed)


@pytest.fixture
def mission() -> Callable[..., Mission]:
    return small
