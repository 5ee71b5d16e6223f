"""The pictures that every run leaves in its folder."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from fieldrl.figures import (
    convergence,
    course,
    estimates,
    fields,
    files,
    learning,
    paths,
    residuals,
    uncertainty,
)

Drawing = Callable[[xr.Dataset], Figure]


def draw_run(record: xr.Dataset, folder: Path) -> list[Path]:
    """Draw a run's pictures into ``folder`` (made where it is missing), each with a JSON beside it.

    Args:
        record: the run's record.
        folder: where to.

    Returns:
        The PNG files: path, learning curve, residuals, course and field error where the model has a field,
        convergence where the fits left traces.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    if not fields.has_field(record):
        warnings.warn("the model has no field: pictures of it are left out", stacklevel=2)
    return [
        files.save(draw(record), folder / f"{name}.png", record) for name, draw in drawings(record).items()
    ]


def drawings(record: xr.Dataset) -> dict[str, Drawing]:
    """The drawing function of every picture that this record has the data for, by file name."""
    if estimates.is_estimate(record):
        chosen: dict[str, Drawing] = {"samples": estimates.field_figure} if fields.has_field(record) else {}
        chosen |= {"residuals": residuals.estimate_residuals_figure, "fit": estimates.fit_figure}
        return chosen | _field_std(record) | _regions(record)
    chosen = {"course": course.course_figure} if course.has_course(record) else {}
    chosen |= {
        "path": paths.path_figure,
        "learning_curve": learning.learning_curve_figure,
    }
    if fields.has_field(record):
        chosen["field_error"] = fields.field_error_figure
    chosen |= _field_std(record) | _regions(record)
    if "samples_used" in record:
        chosen["samples_used"] = uncertainty.samples_used_figure
    if residuals.has_residuals(record):
        chosen["residuals"] = residuals.mission_residuals_figure
    if convergence.has_convergence(record):
        chosen["convergence"] = convergence.convergence_figure
    return chosen


def _field_std(record: xr.Dataset) -> dict[str, Drawing]:
    known = "field_std" in record and fields.has_field(record)
    return {"field_std": uncertainty.field_std_figure} if known else {}


def _regions(record: xr.Dataset) -> dict[str, Drawing]:
    return {"regions": uncertainty.regions_figure} if "best_region_above" in record else {}
