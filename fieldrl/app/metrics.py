"""What a record looks like as metrics: names and series by episode; no MLflow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

Series = dict[str, NDArray[np.float64]]

_FITS = "fit/"  # metrics by solve, of which every replicate has its own number


def series(replicate: xr.Dataset, names: Sequence[str], true: ArrayLike) -> Series:
    """Metrics of a replicate by learning episode, each (episodes,), and the course of its fits by solve.

    Args:
        replicate: a record without the dimension replicate.
        names: of the parameters, (p,).
        true: their true values, (p,), NaN where nobody knows them.
    """
    solves = {"forward_solves": np.asarray(replicate["forward_solves"].values, dtype=float)}
    return _by_episode(replicate, "", names, true) | solves | _course(replicate)


def evaluation(replicate: xr.Dataset, names: Sequence[str], true: ArrayLike) -> Series:
    """Metrics of a replicate by evaluation episode of the greedy policy, each (evaluation episodes,)."""
    if not replicate.sizes.get("evaluation_episode"):
        return {}
    found = _by_episode(replicate, "evaluation_", names, true)
    return {f"evaluation/{name}": values for name, values in found.items()}


def each(record: xr.Dataset) -> list[tuple[Series, Series]]:
    """``series`` and ``evaluation`` of every replicate of a whole record."""
    names, true = [str(name) for name in record["parameter"].values], record["true"].values
    replicates = (record.isel(replicate=i) for i in range(record.sizes["replicate"]))
    return [(series(item, names, true), evaluation(item, names, true)) for item in replicates]


def middle(replicates: Sequence[tuple[Mapping[str, NDArray], Mapping[str, NDArray]]]) -> Series:
    """Medians over the replicates of ``each``, episode by episode; without the course of the fits."""
    merged = [{**learning, **greedy} for learning, greedy in replicates]
    names = [name for name in merged[0] if not name.startswith(_FITS)]
    return {name: np.median([found[name] for found in merged], axis=0) for name in names}


def greedy(replicates: Sequence[tuple[Series, Series]]) -> list[dict[str, float]]:
    """For each replicate of ``each``: medians over the evaluation episodes; empty where there are none."""
    return [
        {name.removeprefix("evaluation/"): float(np.median(values)) for name, values in found.items()}
        for _, found in replicates
        if found
    ]


def late(replicates: Sequence[tuple[Series, Series]]) -> list[float]:
    """For each replicate of ``each``: mean e_total over the last quarter of the learning episodes."""
    return [
        float(np.mean(found["e_total"][-max(1, len(found["e_total"]) // 4) :])) for found, _ in replicates
    ]


def final(summary: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a summary, as metrics ``best/<name>``, and what the run cost."""
    names = ("e_f", "e_cv", "e_total", "theta_error", "field_rmse")
    found = {f"best/{name}": summary[name] for name in names}
    found |= {f"best/theta.{name}": value["estimate"] for name, value in summary["parameters"].items()}
    found |= {f"pooled/{name}": value["estimate"] for name, value in summary["pooled"]["parameters"].items()}
    found |= {"run/late_e_total": float(np.median(summary["late_e_total"]))}
    found |= {f"run/{name}": summary[name] for name in ("forward_solves", "seconds")}
    return {name: float(value) for name, value in found.items() if value is not None}


def _by_episode(replicate: xr.Dataset, prefix: str, names: Sequence[str], true: ArrayLike) -> Series:
    """Return, errors and estimate at the end of each episode."""
    last = replicate.isel(step=-1)
    theta = np.asarray(last[f"{prefix}theta"].values, dtype=float)
    found = {"return": np.asarray(replicate[f"{prefix}return"].values, dtype=float)}
    found |= {
        name: np.asarray(last[f"{prefix}{name}"].values, dtype=float) for name in ("e_f", "e_cv", "e_total")
    }
    found |= {f"theta.{name}": theta[:, i] for i, name in enumerate(names)}
    error = np.linalg.norm(theta - np.asarray(true), axis=-1)
    return found if np.isnan(error).all() else found | {"theta_error": error}


def _course(replicate: xr.Dataset) -> Series:
    """Loss of every solve, and the least so far in its fit, one fit after the other, each (solves,)."""
    if "trace_best" not in replicate:
        return {}
    loss, best = replicate["trace_loss"].values.ravel(), replicate["trace_best"].values.ravel()
    solved = np.isfinite(best) & np.isfinite(loss)
    return {f"{_FITS}loss": loss[solved], f"{_FITS}best_loss": best[solved]}
