"""Pictures of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fieldrl.app.sweeps.objective import Objective
from fieldrl.app.sweeps.results import Row


def draw_grid(rows: Sequence[Row], varied: Sequence[str], objective: Objective, folder: Path) -> None:
    """Draw."""
