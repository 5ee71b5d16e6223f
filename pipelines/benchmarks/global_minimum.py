"""Are the fits global minima? LeastSquares against SciPy from 32 starts, on random problems.

    python -m pipelines.benchmarks.global_minimum               1,000 problems, all cores
    python -m pipelines.benchmarks.global_minimum --problems 40 --jobs 1

A problem is a random walk of the vehicle with 1 to 20 samples, half of them with b = (5, 5), half with
b drawn from (-10, 10)^2. Compared are the full fit and one fold drawn at random. Writes
outputs/global_minimum.json, with all that is needed to see a difference again.

Takes ten minutes.
"""

from __future__ import annotations

import argparse
import json
import time
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection
from fieldrl.vehicle.unicycle import Unicycle

STARTS = 32  # of SciPy, for each fold
RELATIVE, ABSOLUTE = 1e-6, 1e-9  # losses closer than this are equal
CLOSE = 1e-6  # of theta: agreement where the losses are equal
TIGHT = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15}


@cache
def subject() -> tuple[Any, LeastSquares]:
    """The model and the estimator, one of each in a process: its memo is put to the test too."""
    return Advection(), LeastSquares()


def random_problem(number: int) -> FitProblem:
    """Samples of a random walk, 1 to 20 of them; sigma = 1."""
    rng, (model, estimator), vehicle = stream(number, "global minimum"), subject(), Unicycle()
    theta = np.array([5.0, 5.0]) if number % 2 == 0 else rng.uniform(-10.0, 10.0, 2)
    state, samples = vehicle.initial(), Samples.none()
    for step in range(rng.integers(1, 21)):
        action = int(rng.integers(len(vehicle.actions)))
        state = vehicle.step(state, action, float(step), model.flow, theta, model.domain)
        at = np.array([step + 1.0])
        value = model.predict(theta[None], state[None, :2], at)[0, 0] + rng.standard_normal()
        samples = samples.append(state[:2], step + 1.0, value)
    return FitProblem(model, samples, estimator.tikhonov)


def descend(problem: FitProblem, fold: int, u: NDArray) -> tuple[NDArray, float]:
    """SciPy's bounded least squares for one fold, from scaled unknowns u (p,): where it ends, its loss."""
    model: Any = problem.model
    samples, (centre, scale) = problem.samples, (model.parameters.centre, model.parameters.half_width)
    root, pull = np.sqrt(problem.weights[fold]), np.sqrt(problem.tikhonov)

    def residuals(u: NDArray) -> NDArray:
        return np.append(root * problem.residuals((centre + scale * u)[None])[0], pull * u)

    def jacobian(u: NDArray) -> NDArray:
        slopes = model.jacobian((centre + scale * u)[None], samples.positions, samples.times)[0]
        return np.vstack([root[:, None] * slopes * scale, pull * np.eye(u.size)])

    found = least_squares(residuals, u, jac=jacobian, bounds=(-1.0, 1.0), max_nfev=500, **TIGHT)  # pyright: ignore
    return centre + scale * found.x, 2.0 * found.cost


def multistart(problem: FitProblem, fold: int, rng: np.random.Generator, starts: int = STARTS):
    """The best of ``starts`` descents from random places: theta (p,) and its loss."""
    places = rng.uniform(-1.0, 1.0, (starts, len(problem.model.parameters)))
    return min((descend(problem, fold, place) for place in places), key=lambda found: found[1])


def verdict(ours: float, theirs: float) -> str:
    """Which loss is lower: "better", "worse" or "equal" (ours)."""
    slack = ABSOLUTE + RELATIVE * min(ours, theirs)
    if abs(ours - theirs) <= slack:
        return "equal"
    return "better" if ours < theirs else "worse"


def compare(number: int, full: bool = True) -> list[dict[str, Any]]:
    """The full fit (unless left out) and one random fold of a problem, ours against SciPy's."""
    problem, rng = random_problem(number), stream(number, "scipy")
    fit = subject()[1].fit(problem)
    losses = np.diagonal(problem.losses(problem.residuals(fit.theta), fit.theta))
    rows = []
    for fold in [0] * full + [int(rng.integers(1, problem.folds))]:
        theta, loss = multistart(problem, fold, rng)
        rows.append(
            {
                "problem": number,
                "samples": len(problem.samples),
                "fold": fold,
                "verdict": verdict(float(losses[fold]), loss),
                "distance": float(np.abs(fit.theta[fold] - theta).max()),
                "loss": float(losses[fold]),
                "theta": fit.theta[fold].tolist(),
                "scipy_loss": float(loss),
                "scipy_theta": theta.tolist(),
            }
        )
    return rows


def summarise(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts over problems (worse where any of its fits is, else better where any is) and fits."""
    problems: dict[int, set[str]] = {}
    for row in rows:
        problems.setdefault(row["problem"], set()).add(row["verdict"])
    whole = [next(v for v in ("worse", "better", "equal") if v in seen) for seen in problems.values()]
    fits = [row["verdict"] for row in rows]
    far = [row for row in rows if row["verdict"] == "equal" and row["distance"] > CLOSE]
    return {
        "problems": len(problems),
        **{name: whole.count(name) for name in ("worse", "better", "equal")},
        "fits": {name: fits.count(name) for name in ("worse", "better", "equal")},
        "equal_but_farther_than_1e-6": len(far),
        "differences": [row for row in rows if row["verdict"] != "equal"] + far,
    }


def main() -> None:
    """Compare, print the counts, write outputs/global_minimum.json."""
    parser = argparse.ArgumentParser(description="LeastSquares against SciPy from 32 starts.")
    parser.add_argument("--problems", type=int, default=1000)
    parser.add_argument("--jobs", type=int, default=-1, help="worker processes, -1: one for each core")
    options = parser.parse_args()
    subject()[1].fit(random_problem(0))  # compile before the workers start
    begin = time.perf_counter()
    batches: Any = Parallel(n_jobs=options.jobs)(delayed(compare)(k) for k in range(options.problems))
    result = summarise([row for batch in batches for row in batch])
    result["seconds"] = time.perf_counter() - begin
    path = Path("outputs/global_minimum.json")
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(result, indent=1) + "\n")
    for row in result["differences"]:
        if row["verdict"] != "better":
            print(row)
    counts = ", ".join(f"{result[name]} {name}" for name in ("worse", "better", "equal"))
    print(f"{result['problems']} problems: {counts} ({result['seconds']:.0f} s); {path}")
    print(f"{result['equal_but_farther_than_1e-6']} of equal loss, but theta farther apart than {CLOSE:g}")


if __name__ == "__main__":
    from pipelines.benchmarks import global_minimum  # workers import by this name, "__main__" is not theirs

    global_minimum.main()
