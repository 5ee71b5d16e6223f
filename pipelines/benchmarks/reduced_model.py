"""The reduced-order model of the double gyre beside full solves: its error, its speed, its estimates.

    python -m pipelines.benchmarks.reduced_model                   1,000 held-out solves, 60 missions
    python -m pipelines.benchmarks.reduced_model --held-out 0 --rounds 0 --missions 10    a part; 0: not
    python -m pipelines.benchmarks.reduced_model --small           seconds, on a coarse grid

1. Root mean square over the domain of prediction - full solve, at solves that neither its nodes nor its own
   check has seen.
2. Steps a second of the environment, the paper's settings, in turns: the experiment as it is, and with the
   reduced model; both with one truth, and with another in every episode (``scenario=drawn``).
3. The same missions (random walks, noise, true fields of full solves on the finer grid) fitted both ways,
   from nothing: composite on full solves, least squares on the reduced model. Half have the experiment's
   truth.

The model is taken from outputs/reduced_models/, or built. Writes outputs/reduced_model.json.

Takes ten minutes.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl.cli.compose import composed, make_environment
from fieldrl.core.streams import stream
from fieldrl.estimator.problem import FitProblem, errors
from fieldrl.pde.reduced import Building
from fieldrl.runs.components import mission
from pipelines import report
from pipelines.benchmarks.cross_validation import Path, walk

FULL = ("estimator=composite",)
REDUCED = ("pde=reduced_double_gyre", "estimator=least_squares")
DRAWN = ("scenario=drawn",)
OWN_TRUTH = (*DRAWN, "pde.reduced_truth=true", "pde.truth_refinement=1")
SMALL = ("pde.cells=[48,24]",)
SMALL_MODEL = ("pde.nodes=[12,24]", "pde.share=99", "output_dir=outputs/small")
SEED = 1  # of the held-out solves; the model's own check has 0


class Fitted(NamedTuple):
    """One fit: absolute errors of the unknowns (p,), e_total, solves, seconds of the processor."""

    error: list[float]
    e_total: float
    solves: int
    seconds: float


def held_out(model: Any, count: int) -> NDArray[np.float64]:
    """Errors of a reduced model at fresh solves and all times, (count, k) [field unit]; prints the table."""
    found = model.compare(count, SEED)
    rows = [
        _quantiles(f"time {time:g}", column)
        for time, column in zip(model.snapshot_times, found.T, strict=True)
    ]
    rows += [
        _quantiles("the worst time", found.max(axis=1)),
        _quantiles("all times", np.sqrt(np.mean(found**2, axis=1))),
    ]
    columns = (
        "error over the domain, rms",
        "median",
        "95 %",
        "99 %",
        "largest",
        "above a tenth of the noise",
    )
    report.show(f"Reduced model beside {count} full solves, in units of the noise", columns, rows)
    return found


def _quantiles(label: str, values: NDArray) -> tuple[str, ...]:
    numbers = [*np.quantile(values, [0.5, 0.95, 0.99]), values.max()]
    return (label, *(f"{one:.3f}" for one in numbers), f"{100 * np.mean(values > 0.1):.1f} %")


def speeds(small: Sequence[str], reduced: Sequence[str], rounds: int) -> dict[str, list[float]]:
    """Steps a second of the processor in each round, by configuration; prints medians and ratios."""
    several = {
        "full": (FULL, 1),
        "reduced": (reduced, 40),
        "full, drawn truths": ((*FULL, *DRAWN), 1),
        "reduced, drawn truths, these full": ((*reduced, *DRAWN), 2),
        "reduced, drawn truths, these reduced": ((*reduced, *OWN_TRUTH), 40),
    }
    made = {name: (_environment((*small, *chosen)), count) for name, (chosen, count) in several.items()}
    found: dict[str, list[float]] = {name: [] for name in made}
    for number in range(rounds + 1):  # the first compiles and is not counted
        for name, (environment, count) in made.items():
            found[name].append(_speed(environment, count, number))
    found = {name: values[1:] for name, values in found.items()}
    base = np.array(found["full"])
    rows = [(name, report.spread(one), report.spread(np.array(one) / base)) for name, one in found.items()]
    columns = ("environment", "steps a second", "times the first line")
    report.show(f"Median [quartiles] of {rounds} rounds in turns, seconds of the processor", columns, rows)
    return found


def _environment(overrides: Sequence[str]) -> Any:
    environment = make_environment("double_gyre", overrides)
    environment.reset(seed=0)
    return environment


def _speed(environment: Any, episodes: int, number: int) -> float:
    rng, steps, begun = stream(number, "actions"), 0, time.process_time()
    for _ in range(episodes):
        environment.reset()
        over = False
        while not over:
            over = environment.step(int(rng.integers(environment.action_space.n)))[2]
            steps += 1
    return steps / (time.process_time() - begun)


def fitted(task: Any, path: Path, steps: int) -> Fitted:
    """The samples of a mission, all folds, by a task's estimator on its model."""
    samples = path.samples.where(np.arange(steps))
    problem = FitProblem(task.water, samples, task.estimator.tikhonov)
    begun = time.process_time()
    fit = task.estimator.fit(problem)
    seconds = time.process_time() - begun
    off = np.abs(fit.theta[0] - path.theta).tolist()
    return Fitted(off, errors(fit).e_total, fit.evaluations, seconds)


def estimates(small: Sequence[str], reduced: Sequence[str], missions: int) -> dict[str, list[Fitted]]:
    """Fits of the same missions both ways; prints them side by side."""
    tasks = {name: _task((*small, *chosen)) for name, chosen in {"full": FULL, "reduced": reduced}.items()}
    found: dict[str, list[Fitted]] = {name: [] for name in tasks}
    for number in range(missions):
        path = walk((*small, "pde.solutions.memory=64"), number, 0, number % 2 == 1)
        for name, task in tasks.items():
            found[name].append(fitted(task, path, task.steps))
    names, half_width = tasks["full"].water.parameters.names, tasks["full"].water.parameters.half_width
    rows = [_row(name, fits) for name, fits in found.items()]
    columns = (
        "model",
        *(f"error of {name}" for name in names),
        "e_total",
        "solves or evaluations",
        "seconds a fit",
    )
    report.show(f"{missions} missions, median [quartiles]", columns, rows)
    apart = np.array([one.e_total for one in found["reduced"]]) - [one.e_total for one in found["full"]]
    within = np.quantile(abs(apart), 0.9)
    print(f"e_total, reduced - full: median {np.median(apart):.2g}, 90 % within {within:.2g}")
    far = np.abs(np.array([one.error for one in found["reduced"]]) - [one.error for one in found["full"]])
    shares = ", ".join(f"{one:.2g}" for one in np.quantile(far / half_width, 0.9, axis=0))
    print(
        f"the errors of {', '.join(names)} differ by less than {shares} half-widths in 90 % of the missions"
    )
    return found


def _task(overrides: Sequence[str]) -> Any:
    return mission(composed(["experiment=double_gyre", *overrides]))


def _row(name: str, fits: Sequence[Fitted]) -> tuple[str, ...]:
    of_unknowns = [report.spread(column) for column in np.array([one.error for one in fits]).T]
    rest = [report.spread([getattr(one, what) for one in fits]) for what in ("e_total", "solves", "seconds")]
    return (name, *of_unknowns, *rest)


def main() -> None:
    """Everything, from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--held-out", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--missions", type=int, default=60)
    parser.add_argument("--small", action="store_true")
    given = parser.parse_args()
    small, reduced = ((), REDUCED) if not given.small else (SMALL, (*REDUCED, *SMALL_MODEL))
    if given.small:
        given.held_out, given.rounds, given.missions = 20, 2, 2
    warnings.simplefilter("always", Building)
    begun, own = time.perf_counter(), time.process_time()
    model = _task((*small, *reduced)).water
    model.prepare()
    seconds, own = time.perf_counter() - begun, time.process_time() - own
    size = f"{len(model.constants) * 8 / 1e6:.0f} MB with its memo"
    print(f"ready after {seconds:.1f} s ({own:.1f} s of the processor), {size}")
    found = held_out(model, given.held_out) if given.held_out else np.empty(0)
    with threadpool_limits(1):
        of_steps = speeds(small, reduced, given.rounds) if given.rounds else {}
        fits = estimates(small, reduced, given.missions) if given.missions else {}
    content = {
        "held_out": given.held_out, "seconds": seconds, "processor": own, "errors": found.tolist(),
        "steps_a_second": of_steps,
        "fits": {name: [one._asdict() for one in each] for name, each in fits.items()},
    }  # fmt: skip
    report.write("reduced_model", content)


if __name__ == "__main__":
    main()
