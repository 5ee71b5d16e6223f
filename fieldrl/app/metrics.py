"""What a record looks like as MLflow metrics: names and series, no MLflow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Series = dict[str, NDArray[np.float64]]


def series(replicate: xr.Dataset) -> Series:
    """Metrics of a replicate by learning episode, each (episodes,).

    Args:
        replicate: a record without the dimension replicate.
    """
    last = replicate.isel(step=-1)
    names = [str(name) for name in replicate["parameter"].values]
    theta = np.asarray(last["theta"].transpose("episode", "parameter").values, dtype=float)
    found = {"return": _values(replicate["return"])}
    found |= {name: _values(last[name]) for name in ("e_f", "e_cv", "e_total")}
    found |= {f"theta.{name}": theta[:, i] for i, name in enumerate(names)}
    error = np.linalg.norm(theta - replicate["true"].values, axis=-1)
    return found if np.isnan(error).all() else found | {"theta_error": error}


def evaluation(replicate: xr.Dataset) -> Series:
    """Metrics of a replicate by evaluation episode of the greedy policy, each (evaluation episodes,)."""
    if not replicate.sizes.get("evaluation_episode"):
        return {}
    e_total = replicate["evaluation_e_total"]
    last = e_total.isel(step=-1) if "step" in e_total.dims else e_total
    return {"evaluation.return": _values(replicate["evaluation_return"]), "evaluation.e_total": _values(last)}


def median(record: xr.Dataset) -> Series:
    """``series`` of each replicate, as medians over the replicates."""
    each = [series(record.isel(replicate=i)) for i in range(record.sizes["replicate"])]
    return {name: np.median([found[name] for found in each], axis=0) for name in each[0]}


def final(summary: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a summary, as metrics ``best.<name>``, and what the run cost."""
    names = ("e_f", "e_cv", "e_total", "theta_error", "field_rmse")
    found = {f"best.{name}": summary[name] for name in names}
    found |= {f"best.theta.{name}": value["estimate"] for name, value in summary["parameters"].items()}
    found |= {name: summary[name] for name in ("forward_solves", "seconds")}
    return {name: float(value) for name, value in found.items() if value is not None}


def _values(array: xr.DataArray) -> NDArray[np.float64]:
    return np.asarray(array.values, dtype=float)
