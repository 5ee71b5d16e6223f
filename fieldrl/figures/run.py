"""The pictures that every run leaves in its folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from fieldrl.figures import convergence, fields, files, learning, paths

Drawing = Callable[[xr.Dataset], Figure]


def draw_run(record: xr.Dataset, folder: Path) -> list[Path]:
    """Draw a run's pictures into ``folder`` (made where it is missing), each with a JSON beside it.

    Args:
        record: the run's record.
        folder: where to.

    Returns:
        The PNG files: path, learning curve, field error and, where the fits left traces, convergence.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    return [
        files.save(draw(record), folder / f"{name}.png", record) for name, draw in drawings(record).items()
    ]


def drawings(record: xr.Dataset) -> dict[str, Drawing]:
    """The drawing function of every picture that this record has the data for, by file name."""
    chosen: dict[str, Drawing] = {
        "path": paths.path_figure,
        "learning_curve": learning.learning_curve_figure,
        "field_error": fields.field_error_figure,
    }
    if convergence.has_convergence(record):
        chosen["convergence"] = convergence.convergence_figure
    return chosen
