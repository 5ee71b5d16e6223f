"""What all tests share: long files first, hypothesis without deadlines, floating-point errors that raise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import settings

LONG = (
    "test_paper", "test_faults", "test_wheel", "test_calibration", "test_every_option", "test_mlflow",
    "test_sweep_tracking", "test_more_machines", "test_fuzz", "test_resume", "test_bad_input", "test_runs",
)  # fmt: skip
"""Files that take longest, in the order in which they begin: no worker is left with one at the end."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files first; the others as they were found."""
    place = {name: number for number, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(item.path.stem, len(LONG)))


settings.register_profile("fieldrl", deadline=None)
settings.load_profile("fieldrl")


@pytest.fixture(autouse=True)
def floating_point_errors_raise() -> Iterator[None]:
    """Overflow, division by zero and invalid operations raise; underflow is the tail of a Gaussian."""
    with np.errstate(divide="raise", over="raise", invalid="raise", under="ignore"):
        yield
