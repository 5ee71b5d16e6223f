"""How many solves a fit takes: every estimator for dear models on the same random fit problems.

    python -m pipelines.benchmarks.fits             50 problems, the truth anywhere in the bounds, all methods
    python -m pipelines.benchmarks.fits --problems 4 --side 21 --cells 64 32    seconds to minutes, for CI
    python -m pipelines.benchmarks.fits --centre    the experiment's own truth, mu at the centre of its bounds

A problem is a random walk of the vehicle in the double gyre with ten samples, sigma = 1, the truth on a finer
grid. A method has succeeded at the first solve whose loss is within 1 % of e_f of the best known minimum: the
least that any method, or a dense search polished by least squares, has found. Where its estimate is none of
its solves, one more is made there, and counts. BoTorch is compared where it is installed (it is no
dependency). Our estimators have the defaults that we ship; the fit is fold 0 alone (``cross_validation``
judges all folds). What is finished is kept in outputs/fits/ and not computed again unless the code of the
estimators has changed. Writes outputs/fits.json (or fits_centre.json) and a figure beside it.

Takes an hour or two.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl import __version__, estimator
from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.descent.multi_start import Descent, MultiStart
from fieldrl.estimator.evaluations import Evaluations
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import Fit, FitProblem
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.solutions import Solutions
from fieldrl.runs.atomic import write
from fieldrl.vehicle.unicycle import Unicycle
from pipelines import report
from pipelines.benchmarks import botorch_fit
from pipelines.benchmarks.performance_profile import draw

SAMPLES, WITHIN = 10, 0.01
Method = Callable[[FitProblem, int], Fit]


@dataclass(frozen=True)
class RandomSearch:
    """Solves drawn uniformly within the bounds: what every method must beat."""

    budget: int

    def fit(self, problem: FitProblem, number: int) -> Fit:
        """The best of ``budget`` draws."""
        parameters, evaluations = problem.model.parameters, Evaluations(problem)
        rng = stream(number, "random search")
        evaluations.ask_all(
            list(rng.uniform(parameters.lower, parameters.upper, (self.budget, len(parameters))))
        )
        return evaluations.fit()


def methods(rivals: bool = True, botorch: bool = True) -> dict[str, Method]:
    """Every method by its name in the table; without rivals, ours alone."""
    ours: dict[str, Any] = {
        "composite": Composite(),
        "gaussian_process": GaussianProcess(),
        "gaussian_process, scale=linear": GaussianProcess(scale="linear"),
        "least_squares": LeastSquares(),
    }
    named: dict[str, Method] = {name: partial(_without_number, one) for name, one in ours.items()}
    named["random search"] = RandomSearch(150).fit
    if not rivals:
        return {"composite": named["composite"]}
    if botorch and botorch_fit.reason() is None:
        for initial in (10, 5):
            named[f"BoTorch composite EI, {initial} initial"] = partial(
                botorch_fit.fit, initial=initial, budget=35
            )
    return named


def _without_number(one: Any, problem: FitProblem, number: int) -> Fit:
    return one.fit(problem)


def random_problem(number: int, cells: tuple[int, ...], spread: bool) -> FitProblem:
    """Ten samples of a random walk; with ``spread`` the truth lies anywhere in the inner nine tenths."""
    rng, vehicle = stream(number, "fits"), Unicycle(start=(60.0, 40.0))
    water: Any = _water(tuple(cells))
    theta, parameters = np.array(water.parameters.true), water.parameters
    if spread:
        theta = parameters.centre + parameters.half_width * rng.uniform(-0.9, 0.9, len(parameters))
    truth, state, samples = water.truth(), vehicle.initial(), Samples.none()
    for step in range(SAMPLES):
        action = int(rng.integers(len(vehicle.actions)))
        state = vehicle.step(state, action, float(step), water.flow, theta, water.domain)
        samples = samples.append(state[:2], step + 1.0, 0.0)
    exact = truth.predict(theta[None], samples.positions, samples.times)[0]
    values = exact + rng.standard_normal(SAMPLES)
    return FitProblem(water, replace(samples, values=values), leave_one_out=False)


_waters: dict[tuple[int, ...], AdvectionDiffusion] = {}


def _water(cells: tuple[int, ...]) -> AdvectionDiffusion:
    """One model in a process, so that its solves are kept."""
    return _waters.setdefault(cells, AdvectionDiffusion(cells=cells, solutions=Solutions(memory=200.0)))


def dense_losses(problems: list[FitProblem], theta: NDArray, jobs: int) -> NDArray[np.float64]:
    """Loss of every problem at every theta (m, 2): (problems, m); one solve serves all problems."""
    positions = np.concatenate([problem.samples.positions for problem in problems])
    times = np.concatenate([problem.samples.times for problem in problems])
    cells = tuple(problems[0].model.cells)  # pyright: ignore[reportAttributeAccessIssue]
    solve = delayed(_predict)
    predicted = np.array(Parallel(jobs)(solve(cells, one, positions, times) for one in theta))
    predicted = predicted.reshape(len(theta), len(problems), SAMPLES)
    pairs = zip(problems, np.moveaxis(predicted, 1, 0), strict=True)
    return np.array([p.losses(y - p.samples.values, theta)[:, 0] for p, y in pairs])


def _predict(cells: tuple[int, ...], theta: NDArray, positions: NDArray, times: NDArray) -> NDArray:
    with threadpool_limits(1):
        return _water(cells).predict(theta[None], positions, times)[0]


def study(
    number: int, cells: tuple[int, ...], spread: bool, starts: NDArray, compared: dict[str, Method]
) -> dict[str, Any]:
    """One problem by every method, and the least loss polished from ``starts`` (k, 2)."""
    what, courses = (number, tuple(cells), spread), {}
    with threadpool_limits(1):
        for name, method in compared.items():
            settings = getattr(method, "args", ()), getattr(method, "keywords", {})
            courses[name] = kept((*what, name, settings, "estimate"), partial(_course, method, *what))
        least = kept(
            (*what, starts.tolist()), lambda: min(polish(random_problem(*what), one) for one in starts)
        )
    best = min([least, *(np.nanmin(course["loss"]) for course in courses.values())])
    return {"problem": number, "least": float(best), "courses": courses}


def _course(method: Method, number: int, cells: tuple[int, ...], spread: bool) -> dict[str, Any]:
    """The losses of a method's solves in order, its estimate's last, and the seconds that it took."""
    begin, problem = time.perf_counter(), random_problem(number, cells, spread)
    fit = method(problem, number)
    seconds, losses = time.perf_counter() - begin, [] if fit.course is None else fit.course.loss.tolist()
    estimate = fit.theta[:1]
    residuals = problem.model.predict(estimate, problem.samples.positions, problem.samples.times)
    last = float(problem.losses(residuals - problem.samples.values, estimate)[0, 0])
    return {"loss": losses if last in losses else [*losses, last], "seconds": seconds}


def kept(what: Any, compute: Callable[[], Any]) -> Any:
    """``compute()``, or what an earlier run of ``what`` by the same code left in outputs/fits/."""
    told = hashlib.blake2b(repr((what, __version__, code())).encode(), digest_size=10).hexdigest()
    path = report.OUTPUTS / "fits" / f"{told}.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path, json.dumps(compute()).encode())
    return json.loads(path.read_text())


def code() -> str:
    """A hash of the estimators' code."""
    files = sorted(Path(estimator.__path__[0]).rglob("*.py"))
    return hashlib.blake2b(b"".join(path.read_bytes() for path in files), digest_size=10).hexdigest()


def polish(problem: FitProblem, theta: NDArray) -> float:
    """Least loss of a descent from theta (2,)."""
    evaluations, parameters = Evaluations(problem), problem.model.parameters
    descent = Descent(MultiStart(budget=90, tolerance=1e-8), problem, evaluations, 0)
    descent.run((theta - parameters.centre) / parameters.half_width)
    return float(evaluations.fit().loss[0])


def solves_needed(study: dict[str, Any], name: str) -> float:
    """Solves until within 1 % of the best known minimum; infinite where that never happened."""
    losses = np.array(study["courses"][name]["loss"], dtype=float)
    reached = np.flatnonzero(losses <= (1.0 + WITHIN) * study["least"])
    return float(reached[0] + 1) if reached.size else float("inf")


def summary(studies: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Successes, median and ninetieth percentile of solves, and seconds, of every method."""
    table = {}
    for name in studies[0]["courses"]:
        done = [one for one in studies if name in one["courses"]]
        needed = np.array([solves_needed(one, name) for one in done])
        seconds = [one["courses"][name]["seconds"] for one in done]
        table[name] = {
            "successes": int(np.isfinite(needed).sum()),
            "problems": len(done),
            "median": _percentile(needed, 50),
            "ninetieth_percentile": _percentile(needed, 90),
            "most": _percentile(needed, 100),
            "solves_used": float(np.median([len(one["courses"][name]["loss"]) for one in done])),
            "seconds": float(np.median(seconds)),
            "solves_needed": [x if np.isfinite(x) else None for x in needed.tolist()],
        }
    return table


def _percentile(needed: NDArray, share: float) -> float | None:
    value = float(np.percentile(needed, share, method="higher"))
    return value if np.isfinite(value) else None


def main() -> None:
    """Everything, from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--problems", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument(
        "--side", type=int, default=41, help="points of the dense search along each parameter"
    )
    parser.add_argument("--cells", type=int, nargs=2, default=(142, 71))
    parser.add_argument("--rivals", type=int, default=50, help="problems that the other methods are given")
    parser.add_argument("--botorch", type=int, default=50, help="of these, how many BoTorch is given")
    parser.add_argument("--centre", action="store_true", help="the experiment's own truth")
    options = parser.parse_args()
    cells, spread = tuple(options.cells), not options.centre
    name = "fits" if spread else "fits_centre"
    problems = [random_problem(number, cells, spread) for number in range(options.problems)]
    parameters = problems[0].model.parameters
    axes = [np.linspace(a, b, options.side) for a, b in zip(parameters.lower, parameters.upper, strict=True)]
    theta = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(parameters))
    dense = ("dense", len(problems), cells, spread, options.side)
    order = kept(dense, lambda: np.argsort(dense_losses(problems, theta, options.jobs))[:, :3].tolist())
    jobs = (
        delayed(study)(n, cells, spread, theta[order[n]], methods(n < options.rivals, n < options.botorch))
        for n in range(options.problems)
    )
    studies: list[Any] = list(Parallel(options.jobs, verbose=5)(jobs))
    tell(name, studies, {"cells": cells, "side": options.side})


def tell(name: str, studies: list[dict[str, Any]], settings: dict[str, Any]) -> None:
    """The table in the terminal, the JSON and the figure."""
    table = summary(studies)
    columns = ("method", "within 1 %", "median solves", "90 %", "most", "solves used", "seconds")
    keys = ("median", "ninetieth_percentile", "most", "solves_used", "seconds")
    rows = [
        (method, f"{row['successes']} of {row['problems']}", *(_cell(row[key]) for key in keys))
        for method, row in table.items()
    ]
    report.show("Solves until within 1 % of the best known minimum", columns, rows)
    skipped = botorch_fit.reason()
    if skipped:
        print(f"BoTorch left out: {skipped}")
    least = [one["least"] for one in studies]
    content = {"settings": settings, "botorch": skipped or "compared", "methods": table, "least": least}
    report.write(name, content)
    draw({method: row["solves_needed"] for method, row in table.items()}, report.OUTPUTS / f"{name}.png")


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


if __name__ == "__main__":
    main()
