"""e_cv of the second experiment against converged refits of every fold, at the defaults that we ship.

    python -m pipelines.benchmarks.cross_validation        300 fits from nothing, 6 replicates of ten episodes
    python -m pipelines.benchmarks.cross_validation --estimator least_squares --replicates 0
    python -m pipelines.benchmarks.cross_validation --small    seconds, on a coarse grid

Random walks of the vehicle, sigma = 1, the truth on a finer grid. Half of the paths have the experiment's
own truth, the others one drawn in the inner nine tenths of the bounds; of the replicates every third. A fit
from nothing knows no solves; within a replicate solves are shared through steps and episodes, as in the
experiment. Every fold is compared with its global minimum by ``converged_folds``. Writes
outputs/cross_validation_ESTIMATOR.json.

Takes half an hour.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import cache
from typing import Any, NamedTuple, cast

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl.cli.compose import composed
from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.problem import FitProblem, errors
from fieldrl.runs.components import build, mission
from pipelines import report
from pipelines.benchmarks.converged_folds import (
    Folds,
    Interpolant,
    coefficients,
    converge,
    nodes,
    solves,
    water,
)

FEWEST, MOST = 3, 10  # samples of a fit that is judged
EPISODES = 10
HELD_OUT = 60  # solves that measure the interpolation
FULL, FOLD = 1e-3, 0.01  # shares that fold 0 and the other folds may lie above their minima


class Path(NamedTuple):
    """A random walk: the true parameters (2,), and ten samples."""

    theta: NDArray[np.float64]
    samples: Samples


class Judged(NamedTuple):
    """A fit beside the converged one.

    Args:
        samples: n.
        excess: of fold 0 above its minimum, as a share.
        loose: the greatest excess of the other folds, as a share of their minimum or of sigma^2 / (n - 1).
        ratio: e_cv over the converged e_cv.
        converged: whether every fold is said to be.
        solves: new ones.
    """

    samples: int
    excess: float
    loose: float
    ratio: float
    converged: bool
    solves: int


def walk(overrides: Sequence[str], number: int, episode: int, spread: bool) -> Path:
    """Ten samples of a vehicle that turns at random."""
    task, rng = _experiment(tuple(overrides)), stream(number, "walk", episode)
    model: Any = water(overrides)
    theta, parameters = np.array(model.parameters.true), model.parameters
    if spread:
        theta = parameters.centre + parameters.half_width * stream(number, "truth").uniform(-0.9, 0.9, 2)
    vehicle, state, positions = task.vehicle, task.vehicle.initial(), []
    for step in range(MOST):
        action = int(rng.integers(len(vehicle.actions)))
        state = vehicle.step(state, action, step * vehicle.time_step, model.flow, theta, model.domain)
        positions.append(state[:2].copy())
    times = vehicle.time_step * np.arange(1.0, MOST + 1)
    exact = model.truth().predict(theta[None], np.array(positions), times)[0]
    return Path(theta, Samples.of(np.array(positions), times, exact + rng.standard_normal(MOST)))


@cache
def _experiment(overrides: tuple[str, ...]) -> Any:
    return mission(composed(["experiment=double_gyre", *overrides]))


def interpolants(
    paths: Sequence[Path], overrides: Sequence[str], counts: Sequence[int], jobs: int
) -> tuple[list[NDArray], float]:
    """Coefficients of every path's predictions (M, N, 10), and the rms error at solves held out."""
    positions = np.concatenate([path.samples.positions for path in paths])
    times = np.concatenate([path.samples.times for path in paths])
    held_out = stream(0, "held out").uniform(-1, 1, (HELD_OUT, 2))
    lines = [np.stack([np.full(counts[1], x), nodes(counts[1])], axis=1) for x in nodes(counts[0])]
    work = (delayed(solves)(tuple(overrides), u, positions, times) for u in (*lines, held_out))
    *values, there = cast("list[NDArray]", Parallel(jobs)(work))
    table = np.array(values).reshape(*counts, len(paths), MOST)
    found = [coefficients(table[:, :, i]) for i in range(len(paths))]
    errors = np.concatenate([Interpolant(c).predict(held_out) for c in found], axis=1) - there
    return found, float(np.sqrt(np.mean(errors**2)))


def judge(problem: FitProblem, fit: Any, c: NDArray) -> Judged:
    """A fit beside the converged minima of its folds."""
    model, n, parameters = Interpolant(c), len(problem.samples), problem.model.parameters
    best: Folds = converge(model, problem.samples.values, np.array(problem.weights), problem.tikhonov)
    reached = np.diagonal(problem.losses(problem.residuals(fit.theta), fit.theta))
    least = np.diagonal(problem.losses(best.residuals, parameters.centre + parameters.half_width * best.u))
    over = reached - least
    loose = float(np.max(over[1:] / np.maximum(least[1:], 1 / (n - 1))))
    excess, ratio = float(over[0] / least[0]), errors(fit).e_cv / best.e_cv
    return Judged(n, excess, loose, ratio, bool(fit.converged.all()), fit.evaluations)


def alone(name: str, overrides: Sequence[str], number: int, path: Path, c: NDArray) -> Judged:
    """A fit that knows nothing, of 3 to 10 samples."""
    n = FEWEST + number % (MOST - FEWEST + 1)
    problem = FitProblem(water(overrides), _first(path.samples, n))
    estimator: Any = _estimator(name)
    problem = replace(problem, tikhonov=estimator.tikhonov)
    with threadpool_limits(1):
        return judge(problem, estimator.fit(problem), c[:, :, :n])


def replicate(name: str, overrides: Sequence[str], paths: Sequence[Path], cs: Sequence[NDArray]) -> Any:
    """The fits of ten episodes, each of 1 to 10 samples, that share their solves; those of 3 to 10 judged."""
    estimator: Any = _estimator(name)
    known, judged, solves = np.empty((0, 2)), [], 0
    with threadpool_limits(1):
        for path, c in zip(paths, cs, strict=True):
            for n in range(1, MOST + 1):
                problem = FitProblem(
                    water(overrides), _first(path.samples, n), estimator.tikhonov, True, known
                )
                fit = estimator.fit(problem)
                known, solves = fit.known, solves + fit.evaluations
                if n >= FEWEST:
                    judged.append(judge(problem, fit, c[:, :, :n]))
    return judged, solves


def _estimator(name: str) -> Any:
    return build(composed(["experiment=double_gyre", f"estimator={name}"])["estimator"], "estimator")


def _first(samples: Samples, n: int) -> Samples:
    return Samples.of(samples.positions[:n], samples.times[:n], samples.values[:n])


def row(label: str, judged: Sequence[Judged], solves: Sequence[int]) -> tuple[str, ...]:
    """A line of the table."""
    ratio = np.array([one.ratio for one in judged])
    whole = sum(one.excess <= FULL and one.loose <= FOLD for one in judged)
    excess = np.array([one.excess for one in judged])
    quantiles = ", ".join(f"{q:.3f}" for q in np.quantile(ratio, [0, 0.025, 0.5, 0.975, 1]))
    within = [f"{100 * np.mean(np.abs(ratio - 1) <= share):.1f} %" for share in (0.02, 0.05)]
    return (
        label,
        str(len(judged)),
        f"{np.sum(excess <= FULL)}, worst {100 * max(excess.max(), 0):.2g} %",
        str(sum(one.loose <= FOLD for one in judged)),
        str(whole),
        str(sum(one.converged for one in judged)),
        quantiles,
        *within,
        f"{np.median(solves):g}, {max(solves)} at most",
    )


def main() -> None:
    """Everything, from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--estimator", default="composite", help="an option of the group estimator")
    parser.add_argument("--paths", type=int, default=300)
    parser.add_argument("--replicates", type=int, default=6)
    parser.add_argument("--nodes", type=int, nargs=2, default=(48, 124), help="of the interpolation")
    parser.add_argument("--jobs", type=int, default=-1)
    parser.add_argument("--small", action="store_true")
    given = parser.parse_args()
    overrides: tuple[str, ...] = ()
    if given.small:
        given.paths, given.replicates, given.nodes, overrides = 8, 0, (24, 48), ("pde.cells=[64,32]",)
    numbers = range(given.paths)
    walks = [walk(overrides, number, 0, number % 2 == 1) for number in numbers]
    for r in range(given.replicates):
        walks += [walk(overrides, 1000 + r, episode, r % 3 == 2) for episode in range(EPISODES)]
    found, error = interpolants(walks, overrides, given.nodes, given.jobs)
    cold = list(
        Parallel(given.jobs)(
            delayed(alone)(given.estimator, overrides, i, walks[i], found[i]) for i in numbers
        )
    )
    first = range(given.paths, len(walks), EPISODES)
    groups = [slice(begin, begin + EPISODES) for begin in first]
    shared: list[Any] = list(
        Parallel(given.jobs)(
            delayed(replicate)(given.estimator, overrides, walks[g], found[g]) for g in groups
        )
    )
    tell(given, cold, shared, error)


def tell(given: Any, cold: Sequence[Any], shared: Sequence[Any], error: float) -> None:
    """The table in the terminal, and the JSON."""
    settings = asdict(_estimator(given.estimator))
    rows = [row("from nothing", cold, [one.solves for one in cold])]
    judged = [one for fits, _ in shared for one in fits]
    if judged:
        rows.append(row("shared, ten episodes", judged, [solves for _, solves in shared]))
    quantiles = "e_cv / converged: least, 2.5 %, median, 97.5 %, most"
    columns = ("", "fits", "fold 0 within 0.1 %", "folds within 1 %", "both", "said converged", quantiles)
    columns += ("within 2 %", "within 5 %", "solves")
    report.show(f"e_cv by {given.estimator} at its defaults", columns, rows)
    print(f"interpolation error of the converged fits: {error:.2g} rms, in units of the noise")
    content = {
        "estimator": given.estimator, "settings": settings, "interpolation_error": error,
        "alone": [one._asdict() for one in cold],
        "shared": [{"solves": solves, "fits": [one._asdict() for one in fits]} for fits, solves in shared],
    }  # fmt: skip
    report.write(f"cross_validation_{given.estimator}", content)


if __name__ == "__main__":
    main()
