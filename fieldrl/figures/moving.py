"""The best episode as numbers that a page draws and moves by itself: small, sharp at any size."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.figures import maps, style
from fieldrl.figures.course import best_episode


def moving_course(record: xr.Dataset, replicate: int = 0) -> dict[str, Any]:
    """The true field at each moment as bytes, the path, and what each sample said.

    Args:
        record: a run's record with ``field_course``.
        replicate: its index.

    Returns:
        A mapping that is JSON. ``fields`` holds base64 of one byte for each cell, moment by moment, each
        from the upper left corner; 0 is ``low``, 255 is ``high`` [field unit], the colours are ``palette``.
    """
    fields, episode = (
        record["field_course"].transpose("moment", "course_y", "course_x"),
        best_episode(record, replicate),
    )
    low, high = maps.value_range(record["field_course"])
    shades = np.clip(255 * (fields.values[:, ::-1] - low) / (high - low), 0, 255)
    palette = np.round(255 * style.SEQUENTIAL(np.linspace(0, 1, 256))[:, :3])
    return {
        "width": fields.sizes["course_x"], "height": fields.sizes["course_y"],
        "fields": _base64(np.nan_to_num(shades)), "palette": _base64(palette), "low": low, "high": high,
        "lower": _numbers(record.attrs["domain_lower"]), "upper": _numbers(record.attrs["domain_upper"]),
        "obstacles": json.loads(record.attrs.get("obstacles", "[]")),
        "steps": record["course_step"].values.tolist(), "start": _numbers(record["start"].values),
        "path": [_numbers(at) for at in episode["position"].transpose("step", "axis").values],
        "time": _numbers(episode["time"].values), "value": _numbers(episode["value"].values),
        "e_total": _numbers(episode["e_total"].values),
        "names": [str(name) for name in record["parameter"].values],
        "theta": [_numbers(row) for row in episode["theta"].transpose("step", "parameter").values],
    }  # fmt: skip


def _base64(values: NDArray) -> str:
    return base64.b64encode(values.astype(np.uint8).tobytes()).decode()


def _numbers(values: Any) -> list[float | None]:
    """As JSON has them: six digits, null for what is not finite."""
    return [
        float(f"{value:.6g}") if np.isfinite(value) else None for value in np.asarray(values, dtype=float)
    ]
