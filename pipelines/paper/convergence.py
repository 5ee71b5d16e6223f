"""Convergence of the Bayesian optimisation: fits from nothing, and what sharing their solves saves.

python -m pipelines.paper.convergence [scale=small]

Takes seconds, and its run four minutes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from joblib import Parallel, delayed
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fieldrl.estimator.composite import Composite
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.problem import FitProblem
from fieldrl.figures import curves, style
from fieldrl.mission.environment import Estimator
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import gyres
from pipelines.paper.landscape import samples_of

BUDGET = {"paper": 40, "small": 8}  # solves of a fit
_LEAST = 1e-4  # of what is drawn on a logarithmic scale [field unit^2]


def plan(settings: Settings) -> dict[str, Wanted]:
    """The run of table 2."""
    return gyres.PLAN


def make(settings: Settings) -> None:
    """Find the run, fit the samples of its best episodes from nothing, draw."""
    run = experiments.find(plan(settings), settings)[gyres.RUN]
    budget, methods = BUDGET[settings.scale], estimators(BUDGET[settings.scale])
    parts = [run.key, budget, [repr(method) for method in methods.values()]]
    fits = experiments.kept(settings, "convergence", parts, lambda: _fitted(settings, run, methods, budget))
    excess, solves = excess_loss(fits["best"]), run.record["evaluations"].values
    drawing = style.figure(style.PAGE, 2.5)
    left, middle, right = style.panels(drawing, 3)
    drawn = _draw_excess(left, excess)
    _draw_solves(middle, solves)
    _draw_total(right, run.record["forward_solves"].values)
    for axes, letter in ((left, "A"), (middle, "B"), (right, "C")):
        style.letter(axes, letter)
    numbers = {
        "excess_loss": drawn,
        "solves_until_within_1_percent": {str(k): v for k, v in solves_needed(fits["best"]).items()},
        "solves_by_fit": curves.quartiles(solves.reshape(len(solves), -1)),
        "solves_of_replicates": run.record["forward_solves"].sum("episode").values,
        "folds_of_a_replicate": folds(run.record),
    }
    artefacts.save(settings, "convergence", drawing, _caption(run.record, numbers), [run], numbers)


def estimators(budget: int) -> dict[str, Any]:
    """What is compared: ours, and the paper's method on the misfit and on its logarithm."""
    initial = min(10, budget // 2)
    return {
        "composite": Composite(budget=budget),
        "Gaussian process of $\\log e_f$": GaussianProcess(scale="log", budget=budget, initial=initial),
        "Gaussian process of $e_f$": GaussianProcess(scale="linear", budget=budget, initial=initial),
    }


def excess_loss(best: xr.DataArray) -> xr.DataArray:
    """Each fit's best loss so far, less the least that any estimator found, (estimator, problem, solve)."""
    return best - best.min(("estimator", "solve"))


def solves_needed(best: xr.DataArray) -> dict[str, NDArray[np.float64]]:
    """Solves until a fit is within 1 % of the least loss that any method found, NaN where it never is."""
    close = best <= 1.01 * best.min(("estimator", "solve"))
    first = xr.where(close.any("solve"), close.argmax("solve") + 1, np.nan)
    return {str(method): first.sel(estimator=method).values for method in best.estimator.values}


def _fitted(settings: Settings, run: Found, methods: dict[str, Any], budget: int) -> xr.Dataset:
    """The best loss after each solve, every method on the samples of every replicate's best episode."""
    record, water = run.record, run.mission.water
    problems = [samples_of(record, i, int(best)) for i, best in enumerate(record["best_episode"].values)]
    tasks = [
        (method, FitProblem(water, samples, leave_one_out=False))
        for method in methods.values()
        for samples in problems
    ]
    with_workers = Parallel(n_jobs=min(settings.workers, len(tasks)))
    courses: Any = with_workers(delayed(_course)(method, problem, budget) for method, problem in tasks)
    best = np.array(list(courses)).reshape(len(methods), len(problems), budget)
    dims = ("estimator", "problem", "solve")
    return xr.Dataset({"best": (dims, best, {"units": "field unit^2"})}, {"estimator": list(methods)})


def _course(method: Estimator, problem: FitProblem, budget: int) -> NDArray[np.float64]:
    """Best loss after 1, 2, ... solves of a fit that knows nothing, carried on after it ends, (budget,)."""
    course = method.fit(problem).course
    best = np.full(budget, np.nan) if course is None else course.best[:budget]
    return np.append(best, np.full(budget - len(best), best[-1]))


def folds(record: xr.Dataset) -> int:
    """Optimisations that one replicate stands for: n + 1 after the n-th sample of every episode."""
    steps = record.sizes["step"]
    return record.sizes["episode"] * (steps * (steps + 1) // 2 + steps)


def _draw_excess(axes: Axes, excess: xr.DataArray) -> dict[str, NDArray[np.float64]]:
    """Median and quartiles over the problems for each method; returns them."""
    solves = np.arange(1, excess.sizes["solve"] + 1)
    drawn = {}
    for number, method in enumerate(excess.estimator.values):
        values = np.maximum(excess.sel(estimator=method).transpose("problem", "solve").values, _LEAST)
        drawn[str(method)] = curves.draw_compared(axes, solves, values, str(method), number)
    style.logarithmic(axes, 8.0)
    style.open_frame(axes)
    style.count_along_x(axes)
    style.label(axes, "Solves of a fit", "Best loss so far above the least\n[(field unit)$^2$]")
    style.legend(axes, (0.27, 0.07))  # between the floor that one method reaches and the others
    return drawn


def _draw_solves(axes: Axes, solves: NDArray[np.int64]) -> None:
    """New solves of each fit in the order of the run: what is known already is not solved again."""
    each = solves.reshape(len(solves), -1)
    curves.draw_band(
        axes, np.arange(1, each.shape[1] + 1), each, f"median of {len(each)} replicates", steps=True
    )
    for end in range(solves.shape[2], each.shape[1], solves.shape[2]):
        axes.axvline(end + 0.5, color=style.PALE, linewidth=0.5, zorder=0)
    style.open_frame(axes)
    style.label(axes, "Fit, in the order of the run", "New solves")
    style.legend(axes, "upper right")


def _draw_total(axes: Axes, solves: NDArray[np.int64]) -> None:
    """Solves so far, after each episode."""
    total = np.cumsum(solves, axis=1)
    curves.draw_band(axes, np.arange(1, total.shape[1] + 1), total, f"median of {len(total)} replicates")
    axes.set_ylim(0)
    style.open_frame(axes)
    style.count_along_x(axes)
    style.label(axes, "Episode", "Solves so far")


def _caption(record: xr.Dataset, numbers: dict[str, Any]) -> str:
    low, middle, high = np.percentile(numbers["solves_of_replicates"], [25, 50, 75])
    return (
        "Convergence of the Bayesian optimisation. A: fits that know nothing before, of the samples of "
        f"every replicate's best episode ({record.sizes['replicate']} problems): best loss so far above the "
        "least that any method found, median and interquartile range. Composite optimisation models the "
        "predictions, the paper's method the misfit. B: new solves that each fit of the run of table 2 asks "
        "for when solves are shared; grey lines part the episodes. C: its solves so far. A replicate takes "
        f"{middle:.0f} [{low:.0f}, {high:.0f}] solves of the advection-diffusion equation for the "
        f"{numbers['folds_of_a_replicate']} fits and folds of its {record.sizes['episode']} episodes."
    )


if __name__ == "__main__":
    experiments.command(make)
