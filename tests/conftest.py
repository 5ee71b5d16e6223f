"""What every test shares: hypothesis without deadlines, floating-point errors that raise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import settings

settings.register_profile("fieldrl", deadline=None)
settings.load_profile("fieldrl")


@pytest.fixture(autouse=True)
def floating_point_errors_raise() -> Iterator[None]:
    """Overflow, division by zero and invalid operations raise; underflow is the tail of a Gaussian."""
    with np.errstate(divide="raise", over="raise", invalid="raise", under="ignore"):
        yield
