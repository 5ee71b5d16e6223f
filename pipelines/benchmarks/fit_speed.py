"""How fast the first experiment is: the fits against SciPy, and where a run's time goes.

python -m pipelines.benchmarks.fit_speed            the whole
python -m pipelines.benchmarks.fit_speed small      seconds, for CI

Everything is measured in one process, side by side, on the paths of a learning run; speeds are ratios.

Takes two minutes.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
import xarray as xr
from numba import njit
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from fieldrl.cli.compose import composed
from fieldrl.core.samples import Samples
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem, errors
from fieldrl.mission import Mission, run_replicate
from fieldrl.pde.advection import Advection
from fieldrl.runs.components import mission
from pipelines import report


@dataclass
class Stopwatch:
    """Calls an object's methods and adds up the time that they take."""

    watched: Any
    methods: tuple[str, ...]
    seconds: float = field(default=0.0, init=False)

    def __getattr__(self, name: str) -> Any:
        attribute = getattr(self.watched, name)
        return self._timed(attribute) if name in self.methods else attribute

    def _timed(self, method: Callable) -> Callable:
        def timed(*args: Any, **kwargs: Any) -> Any:
            begin = time.perf_counter()
            try:
                return method(*args, **kwargs)
            finally:
                self.seconds += time.perf_counter() - begin

        return timed


def fit_by_scipy(problem: FitProblem, theta: np.ndarray, derivatives: bool) -> np.ndarray:
    """Every fold by ``scipy.optimize.least_squares`` from one warm start: the minimisers (folds, 2)."""
    model, samples = cast(Advection, problem.model), problem.samples
    bounds = model.parameters
    pull = math.sqrt(problem.tikhonov) / bounds.half_width
    found = []
    for weights in problem.weights:
        used = weights > 0
        root, x, t, y = (
            np.sqrt(weights[used]),
            samples.positions[used],
            samples.times[used],
            samples.values[used],
        )

        def residuals(b: np.ndarray, root=root, x=x, t=t, y=y) -> np.ndarray:
            return np.concatenate([root * (model.predict(b[None], x, t)[0] - y), pull * (b - bounds.centre)])

        def jacobian(b: np.ndarray, root=root, x=x, t=t) -> np.ndarray:
            return np.concatenate([root[:, None] * model.jacobian(b[None], x, t)[0], np.diag(pull)])

        box, jac = (bounds.lower, bounds.upper), jacobian if derivatives else "2-point"
        found.append(least_squares(residuals, theta, jac=jac, bounds=box).x)  # pyright: ignore[reportArgumentType]
    return np.array(found)


def compare_fits(task: Mission, record: xr.Dataset, problems: int, repeats: int) -> dict[str, list[float]]:
    """e_total at the last step of ``problems`` episodes: ours, and SciPy with and without derivatives."""
    estimator, water = LeastSquares(), task.water
    columns: dict[str, list[float]] = {"ours": [], "scipy": [], "scipy_derivatives": [], "difference": []}
    for episode in np.linspace(0, record.sizes["episode"] - 1, problems).astype(int):
        run = record.isel(episode=episode)
        samples = Samples.of(run["measured_position"].values, run["time"].values, run["value"].values)
        problem = FitProblem(water, samples, estimator.tikhonov)
        before = FitProblem(water, samples.without(len(samples) - 1), estimator.tikhonov)
        seconds = []
        for _ in range(repeats):
            estimator.fit(before)  # as in an episode: the samples before the newest have been seen
            begin = time.perf_counter()
            fit = estimator.fit(problem)
            errors(fit)
            seconds.append(time.perf_counter() - begin)
        columns["ours"].append(float(np.median(seconds)))
        warm = estimator.fit(before).theta[0]
        for name, derivatives in (("scipy", False), ("scipy_derivatives", True)):
            begin = time.perf_counter()
            theta = fit_by_scipy(problem, warm, derivatives)
            columns[name].append(time.perf_counter() - begin)
        columns["difference"].append(float(np.median(np.abs(theta - fit.theta).max(axis=1))))
    return columns


@njit(error_model="numpy")
def _exponentials(x: np.ndarray, repeats: int) -> float:
    total = 0.0
    for _ in range(repeats):
        for i in range(x.size):
            total += math.exp(x[i])
    return total


def seconds_of_exponential() -> float:
    """Seconds of one exponential in a compiled loop."""
    x = np.linspace(-30.0, 0.0, 1000)
    _exponentials(x, 1)
    begin = time.perf_counter()
    _exponentials(x, 1000)
    return (time.perf_counter() - begin) / 1e6


def count_exponentials(record: xr.Dataset, grid: int) -> int:
    """Exponentials of all fits: one grid row for each sample, and n for each further evaluation."""
    n = np.arange(1, record.sizes["step"] + 1)
    descents = record["evaluations"].values - grid
    return int((grid + n * descents).sum())


def split_run(task: Mission, grid: int, repeats: int) -> dict[str, list[float]]:
    """A whole learning run: its seconds, and the share of estimation and learning."""
    columns: dict[str, list[float]] = {"seconds": [], "estimation": [], "learning": [], "exponentials": []}
    for seed in range(repeats):
        estimator = Stopwatch(task.estimator, ("fit",))
        agent = Stopwatch(task.agent, ("act", "learn", "begin_episode"))
        begin = time.perf_counter()
        record = run_replicate(replace(task, estimator=estimator, agent=agent), seed, 0)
        seconds = time.perf_counter() - begin
        cost = count_exponentials(record, grid) * seconds_of_exponential()
        columns["seconds"].append(seconds)
        columns["estimation"].append(estimator.seconds / seconds)
        columns["learning"].append(agent.seconds / seconds)
        columns["exponentials"].append(seconds / cost)
    return columns


def main(scale: str = "full") -> dict[str, Any]:
    """Measure, print, write outputs/benchmark.json; returns what was written."""
    small = scale == "small"
    episodes, problems, repeats, runs = (20, 3, 5, 1) if small else (400, 40, 40, 5)
    overrides = ["experiment=advection", f"episodes={episodes}", "evaluation_episodes=0"]
    task = mission(composed(overrides))
    with threadpool_limits(1):
        record = run_replicate(task, 0, 0)
        fits = compare_fits(task, record, problems, repeats)
        run = split_run(task, LeastSquares().grid ** 2, runs)
    ours = np.array(fits["ours"])
    ratios = {name: (np.array(fits[name]) / ours).tolist() for name in ("scipy", "scipy_derivatives")}
    n = record.sizes["step"]
    report.show(
        f"e_total at n = {n}: all {n + 1} folds, {problems} paths",
        ("method", "milliseconds", "times as long as fieldrl"),
        [
            ("fieldrl, every fold to its global minimum", report.spread(1e3 * ours), "1"),
            (
                "SciPy, one warm start",
                report.spread(1e3 * np.array(fits["scipy"])),
                report.spread(ratios["scipy"]),
            ),
            (
                "SciPy, one warm start, our derivatives",
                report.spread(1e3 * np.array(fits["scipy_derivatives"])),
                report.spread(ratios["scipy_derivatives"]),
            ),
        ],
    )
    report.show(
        f"A run of {episodes} episodes of {n} samples, one process",
        ("what", "median [quartiles]"),
        [
            ("seconds", report.spread(run["seconds"])),
            ("share of estimation", report.spread(run["estimation"])),
            ("share of learning", report.spread(run["learning"])),
            ("times the cost of its exponentials", report.spread(run["exponentials"])),
        ],
    )
    content = {"scale": scale, "fits": fits, "ratios": ratios, "run": run}
    report.write("benchmark", content)
    return content


if __name__ == "__main__":
    main(*sys.argv[1:])
