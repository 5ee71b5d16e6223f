"""How an estimator for dear models copes with more unknowns: one to six of the second experiment.

    python -m pipelines.benchmarks.unknowns             ten problems for each number of unknowns
    python -m pipelines.benchmarks.unknowns --problems 1 --cells 48 24 --most 3    a minute or two, for CI

The unknowns are the first p of mu, omega, diffusivity, amplitude and the centre of the feature, within
``BOUNDS``. A problem is a random walk of the vehicle with ten samples, sigma = 1, the truth anywhere in the
inner nine tenths of the bounds and on a finer grid. Every estimator has its defaults and fits all folds.
The table counts the solves until fold 0 was first within 1 % of its minimum, those of the whole job, and how
often fold 0, and fold 0 with all others, ended within 1 % of their minima (others: or of sigma^2 / (n - 1)).
A minimum is the least that any method found, or a descent of the fold from the best of all or from the truth.
BoTorch, where it is installed, has 60 solves for fold 0 alone. What is finished is kept in outputs/fits/.
Writes outputs/unknowns.json.

Takes two hours.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.descent.multi_start import Descent, MultiStart
from fieldrl.estimator.evaluations import Evaluations
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import Fit, FitProblem
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.vehicle.unicycle import Unicycle
from pipelines import report
from pipelines.benchmarks import botorch_fit
from pipelines.benchmarks.fits import SAMPLES, WITHIN, kept

BOUNDS = {
    "mu": (0.0, 0.5),
    "omega": (0.1, 1.3),
    "diffusivity": (0.2, 3.0),
    "amplitude": (50.0, 150.0),
    "centre_x": (45.0, 75.0),
    "centre_y": (25.0, 55.0),
}
OURS: dict[str, Any] = {
    "composite": Composite(),
    "least_squares": LeastSquares(),
    "gaussian_process": GaussianProcess(),
}
BOTORCH = {"initial": 10, "budget": 60}


def water(p: int, cells: tuple[int, ...]) -> AdvectionDiffusion:
    """The double gyre with the first p unknowns, the true values at the middle of their bounds."""
    named = list(BOUNDS.items())[:p]
    unknown = {name: {"true": (a + b) / 2, "lower": a, "upper": b} for name, (a, b) in named}
    return AdvectionDiffusion(cells=cells, unknown=unknown)


def random_problem(p: int, number: int, cells: tuple[int, ...]) -> tuple[FitProblem, NDArray[np.float64]]:
    """Ten samples of a random walk with all folds, and the true unknowns (p,)."""
    model, rng, vehicle = water(p, cells), stream(number, "unknowns", p), Unicycle(start=(60.0, 40.0))
    parameters: Any = model.parameters
    theta = parameters.centre + parameters.half_width * rng.uniform(-0.9, 0.9, p)
    state, positions, times = vehicle.initial(), np.empty((SAMPLES, 2)), np.arange(1.0, SAMPLES + 1)
    flow_theta = model.flow_parameters(theta)
    for step in range(SAMPLES):
        action = int(rng.integers(len(vehicle.actions)))
        state = vehicle.step(state, action, float(step), model.flow, flow_theta, model.domain)
        positions[step] = state[:2]
    values = model.truth().predict(theta[None], positions, times)[0] + rng.standard_normal(SAMPLES)
    return FitProblem(model, Samples.of(positions, times, values)), theta


def ours(name: str, p: int, number: int, cells: tuple[int, ...]) -> dict[str, Any]:
    """A fit of all folds by an estimator of ours."""
    problem, _ = random_problem(p, number, cells)
    return _told(OURS[name].fit(problem), problem)


def botorch(p: int, number: int, cells: tuple[int, ...]) -> dict[str, Any]:
    """A fit of fold 0 by BoTorch."""
    problem, _ = random_problem(p, number, cells)
    problem = replace(problem, leave_one_out=False)
    return _told(botorch_fit.fit(problem, number, **BOTORCH), problem)


def _told(fit: Fit, problem: FitProblem) -> dict[str, Any]:
    """What is kept of a fit: minimisers, their losses, those of fold 0 in the order of the solves."""
    course = [] if fit.course is None else fit.course.loss.tolist()
    losses = problem.losses(problem.residuals(fit.theta), fit.theta).diagonal()
    return {"theta": fit.theta.tolist(), "loss": losses.tolist(), "solves": fit.evaluations, "course": course}


def minima(p: int, number: int, cells: tuple[int, ...], found: list[Any]) -> list[float]:
    """The least known loss of every fold, after descents from the best and from the truth, (folds,)."""
    problem, theta = random_problem(p, number, cells)
    evaluations, parameters = Evaluations(problem), problem.model.parameters
    evaluations.ask_all([theta, *(np.array(one) for thetas in found for one in thetas)])
    for fold in range(problem.folds):
        descent = Descent(MultiStart(budget=200, tolerance=1e-8), problem, evaluations, fold)
        descent.run(descent.best())
        if not fold:
            descent.run((theta - parameters.centre) / parameters.half_width)
    return evaluations.fit().loss.tolist()


def study(p: int, number: int, cells: tuple[int, ...]) -> dict[str, Any]:
    """One problem by every method, each with what it reached beside the least known losses."""
    what, fits = (p, number, cells), {}
    with threadpool_limits(1):
        for name, one in OURS.items():
            fits[name] = kept(("unknowns", *what, repr(one)), partial(ours, name, *what))
        if botorch_fit.reason() is None:
            fits["BoTorch"] = kept(("unknowns", *what, BOTORCH), partial(botorch, *what))
        found = [fit["theta"] for fit in fits.values()]
        least = np.array(kept(("minima", *what, repr(found)), partial(minima, *what, found)))
    for fit in fits.values():
        least[0] = min(least[0], np.nanmin(fit["course"]))
    return {"p": p, "problem": number, "fits": {name: judge(fit, least) for name, fit in fits.items()}}


def judge(fit: dict[str, Any], least: NDArray[np.float64]) -> dict[str, Any]:
    """Solves until fold 0 was found (infinite: never), of the whole job, and whether either succeeded."""
    reached = np.flatnonzero(np.array(fit["course"], dtype=float) <= (1 + WITHIN) * least[0])
    full = fit["loss"][0] <= (1 + WITHIN) * least[0]
    folds = np.array(fit["loss"][1:])
    tolerated = WITHIN * np.maximum(least[1:], 1 / (SAMPLES - 1))
    whole = bool(full and np.all(folds <= least[1:] + tolerated)) if folds.size else None
    first = float(reached[0] + 1) if reached.size else float("inf")
    return {"first": first, "solves": fit["solves"], "full": bool(full), "whole": whole}


def rows(studies: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Lines of the table, a number of unknowns and a method each."""
    table = []
    for p in sorted({one["p"] for one in studies}):
        for name in studies[0]["fits"]:
            fits = [one["fits"][name] for one in studies if one["p"] == p]
            first = np.percentile([fit["first"] for fit in fits], 50, method="higher")
            jobs = f"{np.median([fit['solves'] for fit in fits]):g}"
            alone = fits[0]["whole"] is None
            shares = [sum(bool(fit[key]) for fit in fits) for key in ("full", "whole")]
            cells = [f"{first:g}" if np.isfinite(first) else "-", jobs, str(shares[0])]
            table.append((f"{p}, {name}", str(len(fits)), *cells, "-" if alone else str(shares[1])))
    return table


def main() -> None:
    """Everything, from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--problems", type=int, default=10, help="for each number of unknowns")
    parser.add_argument("--most", type=int, default=len(BOUNDS), choices=range(1, len(BOUNDS) + 1))
    parser.add_argument("--cells", type=int, nargs=2, default=(142, 71))
    parser.add_argument("--jobs", type=int, default=-1)
    given = parser.parse_args()
    cells = tuple(given.cells)
    tasks = [(p, number, cells) for p in range(1, given.most + 1) for number in range(given.problems)]
    studies: list[Any] = list(Parallel(given.jobs, verbose=5)(delayed(study)(*task) for task in tasks))
    columns = (
        "unknowns, method",
        "problems",
        "solves until fold 0",
        "solves of the job",
        "fold 0",
        "all folds",
    )
    table = rows(studies)
    report.show("Solves and successes (within 1 %) by number of unknowns; medians", columns, table)
    skipped = botorch_fit.reason()
    if skipped:
        print(f"BoTorch left out: {skipped}")
    settings = {"cells": cells, "bounds": BOUNDS, "botorch": skipped or BOTORCH}
    report.write("unknowns", {"settings": settings, "studies": studies})
    print(report.markdown(columns, table))


if __name__ == "__main__":
    main()
