"""What a record looks like as metrics: names and series by episode; no MLflow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core.parameters import Parameters
from fieldrl.mission.summary import parameters as unknowns
from fieldrl.runs.meaning import from_file

Series = dict[str, NDArray[np.float64]]

_FITS = "fit/"  # a metric by solve, of which every replicate has its own number
_BEST = ("e_total", "theta_error", "field_rmse")  # numbers of the best episode
_LEARNING = ("e_total", "e_f", "e_cv", "return", "theta_error", "converged")


def of_replicate(replicate: xr.Dataset, parameters: Parameters) -> tuple[Series, Series]:
    """Metrics of a replicate: by learning episode and by evaluation episode of the greedy policy.

    Args:
        replicate: a record without the dimension replicate.
        parameters: the unknowns.

    Returns:
        Each (episodes,), and with the first the regret of the fits, (solves,); the second is empty where
        there are no evaluation episodes.
    """
    solves = {"forward_solves": np.asarray(replicate["forward_solves"].values, dtype=float)}
    learning = _by_episode(replicate, "", parameters) | solves | _course(replicate)
    if not replicate.sizes.get("evaluation_episode"):
        return learning, {}
    found = _by_episode(replicate, "evaluation_", parameters)
    return learning, {f"evaluation/{name}": values for name, values in found.items()}


def each(record: xr.Dataset) -> list[tuple[Series, Series]]:
    """``of_replicate`` for every replicate of a whole record."""
    parameters = unknowns(record)
    replicates = (record.isel(replicate=i) for i in range(record.sizes["replicate"]))
    return [of_replicate(item, parameters) for item in replicates]


def all_curves(record: xr.Dataset) -> list[Series]:
    """``curves`` of every replicate of a whole record; those of the fit alone of an estimate from a file."""
    parameters = unknowns(record)
    if record.attrs.get("kind") == "estimate":
        return [_course(record.isel(replicate=0))]
    return [curves(learning, parameters) for learning, _ in each(record)]


def middle(replicates: Sequence[Series]) -> Series:
    """Medians over the ``curves`` of replicates, episode by episode; without the course of the fits."""
    names = [name for name in replicates[0] if not name.startswith(_FITS)]
    return {name: np.median([found[name] for found in replicates], axis=0) for name in names}


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


def curves(learning: Mapping[str, NDArray], parameters: Parameters) -> Series:
    """What a tracker draws of a replicate.

    Args:
        learning: by learning episode, see ``of_replicate``, each (episodes,).
        parameters: the unknowns.

    Returns:
        ``learning/...`` by episode, with the mean e_total so far and the forward solves so far;
        ``estimate/NAME`` and, where the truth is known, ``error/NAME`` (estimate minus truth); ``fit/regret``
        by solve.
    """
    found = {f"learning/{name}": learning[name] for name in _LEARNING if name in learning}
    episodes = np.arange(1, len(learning["e_total"]) + 1)
    found["learning/mean_e_total"] = np.cumsum(learning["e_total"]) / episodes
    found["learning/forward_solves"] = np.cumsum(learning["forward_solves"])
    for name, value in zip(parameters.names, parameters.true, strict=True):
        found[f"estimate/{name}"] = learning[f"theta.{name}"]
        if np.isfinite(value):
            found[f"error/{name}"] = learning[f"theta.{name}"] - value
    return found | {name: values for name, values in learning.items() if name.startswith(_FITS)}


def final(summary: Mapping[str, Any]) -> dict[str, float]:
    """The numbers that runs are compared by; estimates are in ``best/`` and ``pooled/``.

    Of all samples' estimate also the standard deviation, ``pooled_std/``, and the width of its interval of
    95 %, ``pooled_width/``. An estimate from a file has no best episode and no policy.
    """
    found = {name: summary[name] for name in (*_BEST, "converged", "seconds")}
    if from_file(summary):
        found |= {name: summary[name] for name in ("e_f", "e_cv", "noise")} | {
            "samples": summary["samples"]["used"]
        }
    else:
        found["late_e_total"] = float(np.median(summary["late_e_total"]))
        found |= {f"best/{name}": one["estimate"] for name, one in summary["parameters"].items()}
    found |= {f"pooled/{name}": one["estimate"] for name, one in summary["pooled"]["parameters"].items()}
    for name, one in summary["pooled"]["parameters"].items():
        low, high = one.get("interval") or (None, None)
        found[f"pooled_std/{name}"] = one.get("std")
        found[f"pooled_width/{name}"] = None if low is None or high is None else high - low
    policy = summary.get("greedy") or []
    for name in ("e_total", "return"):
        values = [row[name] for row in policy if name in row]
        found |= {f"greedy/{name}": float(np.median(values))} if values else {}
    return {name: float(value) for name, value in found.items() if value is not None}


def _by_episode(replicate: xr.Dataset, prefix: str, parameters: Parameters) -> Series:
    """Return, errors and estimate at the end of each episode."""
    last = replicate.isel(step=-1)
    theta = np.asarray(last[f"{prefix}theta"].values, dtype=float)
    found = {"return": np.asarray(replicate[f"{prefix}return"].values, dtype=float)}
    found |= {
        name: np.asarray(last[f"{prefix}{name}"].values, dtype=float) for name in ("e_f", "e_cv", "e_total")
    }
    found |= {"converged": np.asarray(replicate[f"{prefix}converged"].mean("step").values, dtype=float)}
    found |= {f"theta.{name}": theta[:, i] for i, name in enumerate(parameters.names)}
    error = parameters.distance(theta, last.get(f"{prefix}truth"))
    return found if np.isnan(error).all() else found | {"theta_error": error}


def _course(replicate: xr.Dataset) -> Series:
    """Regret by solve, (solves,): least loss so far above the fit's final one, median over the fits."""
    if "trace_best" not in replicate:
        return {}
    best = replicate["trace_best"].values
    best = best.reshape(-1, best.shape[-1])
    best = np.fmin.accumulate(best[np.isfinite(best).any(axis=1)], axis=1)
    if not best.size:
        return {}
    best = np.where(np.isnan(best), np.nanmax(best, axis=1, keepdims=True), best)  # before a first success
    return {f"{_FITS}regret": np.median(best - best[:, -1:], axis=0)}
