"""The result of a record in a few numbers: the part of ``summary.json`` that follows from it."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from fieldrl.core.parameters import Parameters


def summarise(record: xr.Dataset) -> dict[str, Any]:
    """Best episode of replicate 0, the same for every replicate, and the pooled estimate.

    Args:
        record: of a whole run.
    """
    table = [replicate_result(record.isel(replicate=i)) for i in range(record.sizes["replicate"])]
    first = dict(table[0])
    pooled = first.pop("pooled")
    return {
        "replicates": record.sizes["replicate"],
        "episodes": record.sizes["episode"],
        "steps": record.sizes["step"],
        "finished": True,
        **first,
        "pooled": pooled,
        "replicates_table": [{"replicate": i, **row} for i, row in enumerate(table)],
    }


def parameters(record: xr.Dataset) -> Parameters:
    """The unknowns of a record."""
    names, units = (tuple(map(str, record[name].values)) for name in ("parameter", "parameter_unit"))
    lower, upper, true = (tuple(record[name].values.tolist()) for name in ("lower", "upper", "true"))
    return Parameters(names, units, lower, upper, true)


def replicate_result(record: xr.Dataset) -> dict[str, Any]:
    """Estimate and errors of a replicate's best episode, and what they cost.

    Args:
        record: of one replicate, without the dimension ``replicate``.
    """
    best = int(record["best_episode"])
    last = record.isel(episode=best, step=-1)
    names = [str(name) for name in record["parameter"].values]
    true, theta = last.get("truth", record["true"]).values, last["theta"].values
    units = [str(unit) for unit in record["parameter_unit"].values]
    difference = record["field_estimate"].values - record["field_true"].values
    return {
        "parameters": {
            name: {
                "true": _number(true[k]),
                "estimate": _number(theta[k]),
                "unit": units[k],
                **_trust(record, "best", k),
            }
            for k, name in enumerate(names)
        },
        "best_episode": best,
        **{name: _number(last[name].values) for name in ("e_f", "e_cv", "e_total")},
        "theta_error": _number(parameters(record).distance(theta, true)),
        "field_rmse": _number(np.sqrt(np.nanmean(difference**2))) if np.isfinite(difference).any() else None,
        "forward_solves": int(record["forward_solves"].sum()),
        "converged": _number(record["converged"].mean().values),
        "pooled": {
            "parameters": {
                name: {"estimate": _number(value), **_trust(record, "pooled", k)}
                for k, (name, value) in enumerate(zip(names, record["pooled"].values, strict=True))
            }
        },
        "verdict": str(record["verdict"].values),
        **_samples_used(record),
    }


def _samples_used(record: xr.Dataset) -> dict[str, Any]:
    """Samples that each episode took, where they may end early."""
    return {"samples_used": record["samples_used"].values.tolist()} if "samples_used" in record else {}


def _trust(record: xr.Dataset, name: str, k: int) -> dict[str, Any]:
    """Standard deviation (None where nothing is told), 95 % interval, and whether unknown k is identified."""
    return {
        "std": _number(record[f"{name}_std"].values[k]),
        "interval": [_number(end) for end in record[f"{name}_interval"].values[k]],
        "identified": bool(record[f"{name}_identified"].values[k]),
    }


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
