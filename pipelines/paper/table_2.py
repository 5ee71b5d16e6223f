"""Table 2: the learned parameters of the double gyre, with their spread, and what they cost.

python -m pipelines.paper.table_2              20 replicates, and two steps of the literal method
python -m pipelines.paper.table_2 small        seconds, for CI

The paper optimises every fold of every step on its own. That takes hours, so whole steps of it are measured
and scaled: an episode has n + 1 optimisations after its n-th sample, each of the same budget.

Takes ten minutes.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
import xarray as xr
from threadpoolctl import threadpool_limits

from fieldrl.cli.compose import composed, recorded
from fieldrl.core.samples import Samples
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission import Mission, run_replicate
from fieldrl.runs.components import mission
from pipelines import report
from pipelines.benchmarks.solver import shift

PAPER = {"mu": 0.2481, "omega": 0.6344}
_STEP = 1e-3  # of the differences for the Cramer-Rao bound, in half-widths of the bounds


def errors_of(record: xr.Dataset) -> dict[str, np.ndarray]:
    """Absolute errors of the best episode and of the pooled estimate, (replicates, p) each."""
    true = record["true"].values
    best = [
        record["theta"].isel(replicate=i, episode=int(record["best_episode"][i]), step=-1).values
        for i in range(record.sizes["replicate"])
    ]
    return {"best": np.abs(np.array(best) - true), "pooled": np.abs(record["pooled"].values - true)}


def cramer_rao(task: Mission, record: xr.Dataset, replicate: int, episodes: np.ndarray) -> np.ndarray:
    """Least standard deviations of the parameters from the samples of some episodes, (p,)."""
    run = record.isel(replicate=replicate, episode=episodes)
    positions, times = run["position"].values.reshape(-1, 2), run["time"].values.ravel()
    parameters, truth = task.water.parameters, task.water
    theta, shift = np.array(parameters.true), _STEP * np.diag(parameters.half_width)
    up, down = (truth.predict(theta + sign * shift, positions, times) for sign in (1, -1))
    jacobian = (up - down).T / (2 * np.diag(shift))
    information = jacobian.T @ jacobian / task.vehicle.sensor.noise**2
    return np.sqrt(np.diag(np.linalg.inv(information)))


def grid_shifts(task: Mission, record: xr.Dataset) -> dict[str, list[list[float]]]:
    """How far refining the model's grid once moves what ``errors_of`` is about, in standard deviations."""
    water: Any = task.water
    theta, sampled = np.array(water.parameters.true), record[["position", "time"]]
    found: dict[str, list[list[float]]] = {"best": [], "pooled": []}
    for i in range(record.sizes["replicate"]):
        best = record["best_episode"].values[i : i + 1]
        for kind, episodes in (("best", best), ("pooled", np.arange(task.episodes))):
            run = sampled.isel(replicate=i, episode=episodes)
            positions, times = run["position"].values.reshape(-1, 2), run["time"].values.ravel()
            found[kind].append(shift(water, theta, positions, times).tolist())
    return found


def literal_seconds(task: Mission, record: xr.Dataset, steps: list[int]) -> tuple[float, int, float]:
    """Seconds of one optimisation of the literal method, its share of solves, and those of a whole run."""
    run = record.isel(replicate=0, episode=0)
    estimator, seconds, count = GaussianProcess(share=False), 0.0, 0
    for n in steps:
        fresh = mission(composed(["experiment=double_gyre", "pde.solutions.memory=1"])).water
        positions = run["measured_position"].values[:n]
        samples = Samples.of(positions, run["time"].values[:n], run["value"].values[:n])
        begin = time.perf_counter()
        estimator.fit(FitProblem(fresh, samples, estimator.tikhonov))
        seconds += time.perf_counter() - begin
        count += n + 1
    optimisations = task.episodes * sum(n + 1 for n in range(1, task.steps + 1))
    return seconds / count, optimisations, seconds / count * optimisations


def timed_replicate(task: Mission) -> tuple[float, int]:
    """Seconds and solves of one whole replicate of ours, in this process."""
    fresh = mission(composed(["experiment=double_gyre", "evaluation_episodes=0"]))
    begin = time.perf_counter()
    record = run_replicate(fresh, 0, 0)
    return time.perf_counter() - begin, int(record["forward_solves"].sum())


def bounds_of(task: Mission, record: xr.Dataset) -> dict[str, list[list[float]]]:
    """Cramer-Rao bounds of what ``errors_of`` gives."""
    replicates = range(record.sizes["replicate"])
    best = [cramer_rao(task, record, i, record["best_episode"].values[i : i + 1]) for i in replicates]
    pooled = [cramer_rao(task, record, i, np.arange(task.episodes)) for i in replicates]
    return {"best": [bound.tolist() for bound in best], "pooled": [bound.tolist() for bound in pooled]}


def show_errors(task: Mission, record: xr.Dataset, found: dict[str, dict[str, Any]]) -> None:
    """The errors beside what the samples allow and what the paper found; what the grid does; solves."""
    rows = []
    names = [str(name) for name in record["parameter"].values]
    kinds = (("best", "best episode"), ("pooled", "all episodes' samples"))
    for kind, text in kinds:
        for k, name in enumerate(names):
            paper = f"{abs(PAPER[name] - record['true'].values[k]):.4f}" if kind == "best" else ""
            spreads = (report.spread(np.array(found[what][kind])[:, k]) for what in ("errors", "cramer_rao"))
            rows.append((f"|error of {name}|, {text}", *spreads, paper))
    for kind, text in kinds:
        moved = np.array(found["grid_shifts"][kind]).max(axis=1)
        middle = f"{np.median(moved):.2g}, {moved.max():.2g} at most"
        rows.append((f"shift by a finer grid [std], {text}", middle, "", ""))
    solves = record["forward_solves"].sum("episode").values
    rows += [("solves of a replicate", report.spread(solves), "", ""), ("most of them", solves.max(), "", "")]
    title = f"{record.sizes['replicate']} replicates of {task.episodes} episodes of {task.steps} steps"
    report.show(f"Table 2, {title}", ("", "median [quartiles]", "Cramer-Rao", "paper"), rows)


def compare_costs(task: Mission, record: xr.Dataset, steps: list[int]) -> dict[str, dict[str, float]]:
    """Our time for a replicate beside the literal method's, printed."""
    with threadpool_limits(1):
        each, optimisations, literal = literal_seconds(task, record, steps)
        ours, solves = timed_replicate(task)
    title = f"literal, {optimisations} optimisations of {each:.1f} s (whole steps measured, scaled)"
    rows = [
        ("fieldrl, composite", solves, f"{ours:.1f}", 1),
        (title, optimisations * GaussianProcess().budget, f"{literal:.0f}", f"{literal / ours:.0f}"),
    ]
    report.show("One whole replicate, one process", ("method", "solves", "seconds", "times as long"), rows)
    return {
        "literal": {"seconds_each": each, "optimisations": optimisations, "seconds": literal},
        "ours": {"seconds": ours, "solves": solves, "ratio": literal / ours},
    }


def main(scale: str = "full") -> dict[str, Any]:
    """Run what is missing, print, write outputs/table_2.json; returns what was written."""
    small = scale == "small"
    overrides = ["replicates=2", "episodes=2", "steps=4"] if small else ["replicates=20"]
    task = mission(composed(["experiment=double_gyre", *overrides]))
    record, summary = recorded("double_gyre", overrides)
    found: dict[str, dict[str, Any]] = {
        "errors": {kind: values.tolist() for kind, values in errors_of(record).items()},
        "cramer_rao": bounds_of(task, record),
        "grid_shifts": grid_shifts(task, record),
    }
    show_errors(task, record, found)
    content = {
        "scale": scale,
        "key": summary["key"],
        **found,
        "solves": record["forward_solves"].sum("episode").values.tolist(),
        **compare_costs(task, record, [2] if small else [3, 7]),
    }
    report.write("table_2", content)
    return content


if __name__ == "__main__":
    main(*sys.argv[1:])
