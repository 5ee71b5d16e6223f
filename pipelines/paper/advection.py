"""The first experiment beside the paper, and what changes with estimator, reward and agent.

python -m pipelines.paper.advection          8 replicates of 400 episodes for each variant
python -m pipelines.paper.advection small    seconds, for CI

Runs that are finished are taken as they are; outputs/advection.json holds the numbers and the runs' keys.

Takes two minutes.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import xarray as xr

from fieldrl.cli.compose import recorded
from pipelines import report

VARIANTS = {
    "as the paper, every fit at its global minimum": [],
    "one start for each fit (estimator.starts=1)": ["estimator.starts=1"],
    "one start, trace_decay=0.1": ["estimator.starts=1", "agent.trace_decay=0.1"],
    "reward=information_gain": ["reward=information_gain"],
    "agent=random": ["agent=random"],
    "agent=lawnmower": ["agent=lawnmower"],
}
PAPER_ERROR = 0.0809


def measure(record: xr.Dataset) -> dict[str, list[float]]:
    """Numbers of each replicate: mean e_total early and late, errors of b, return early and late."""
    final = record.isel(step=-1)
    error = ((final["theta"] - record["true"]) ** 2).sum("parameter") ** 0.5
    early, late = slice(0, 50), slice(-100, None)
    best = [float(error.isel(replicate=i, episode=int(b))) for i, b in enumerate(record["best_episode"])]
    return {
        "e_total_first_50": final["e_total"].isel(episode=early).mean("episode").values.tolist(),
        "e_total_last_100": final["e_total"].isel(episode=late).mean("episode").values.tolist(),
        "best_episode_error": best,
        "median_error_first_50": error.isel(episode=early).median("episode").values.tolist(),
        "median_error_last_100": error.isel(episode=late).median("episode").values.tolist(),
        "return_first_50": record["return"].isel(episode=early).mean("episode").values.tolist(),
        "return_last_100": record["return"].isel(episode=late).mean("episode").values.tolist(),
    }


def main(scale: str = "full") -> dict[str, Any]:
    """Run what is missing, print the table, write outputs/advection.json; returns what was written."""
    overrides = ["replicates=2", "episodes=20"] if scale == "small" else []
    found: dict[str, dict[str, Any]] = {}
    for text, more in VARIANTS.items():
        record, summary = recorded("advection", [*overrides, "tracking=none", *more])
        found[text] = {"key": summary["key"], "overrides": more, **measure(record)}
    columns = ("e_total_first_50", "e_total_last_100", "median_error_last_100", "best_episode_error")
    rows = [(text, *(report.spread(numbers[name]) for name in columns)) for text, numbers in found.items()]
    heads = (
        "",
        "e_total, episodes 1-50",
        "e_total, last 100",
        "error of b, last 100",
        "error of b, best episode",
    )
    report.show("First experiment, median [quartiles] over replicates", heads, rows)
    errors = np.array(found[next(iter(VARIANTS))]["best_episode_error"])
    below = int(np.sum(errors < PAPER_ERROR))
    print(f"best episode: |b - b_hat| below the paper's {PAPER_ERROR} in {below} of {errors.size} replicates")
    report.write("advection", {"scale": scale, "variants": found})
    return found


if __name__ == "__main__":
    main(*sys.argv[1:])
