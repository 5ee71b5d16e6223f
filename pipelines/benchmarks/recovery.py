"""Whether unknowns are found again: every kind, random truths, in both experiments.

    python -m pipelines.benchmarks.recovery                200 truths of each kind
    python -m pipelines.benchmarks.recovery --truths 5     minutes

A truth lies anywhere in the inner nine tenths of the bounds. Sixty samples at random places and times (of
the gyre: at whole times, as its vehicle takes them), noise as the vehicle's sensor has it, are made by the
model that is fitted, so that nothing but noise is in the way; the double gyre's grid is small. Estimators
are those of the experiments. An estimate is recovered where every unknown lies within three standard errors.
Another one is told where each unknown that is further off is not identified, has
several solutions, or has the truth in its 95 % interval; else it is silent, as often by chance as the table
says. What is finished is kept in outputs/recovery/ until the code changes.
Writes outputs/recovery.json.

Takes half an hour.
"""

from __future__ import annotations

import argparse
import io
import json
import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission.uncertainty_record import SOLVES
from fieldrl.pde.advection import Advection
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.flow import (
    DoubleGyre,
    GriddedFlow,
    Rotated,
    Scaled,
    Shear,
    SolidRotation,
    Sum,
    TaylorGreen,
    UniformFlow,
    Vortices,
)
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.solutions import Solutions
from fieldrl.pde.source import LocalisedSource
from fieldrl.runs import atomic
from fieldrl.runs.contents import package
from fieldrl.uncertainty import assess, noise_of
from fieldrl.vehicle.sensor import Sensor
from pipelines import report

SAMPLES, FAR, DURATION = 60, 3.0, 6.0
NOISE = Sensor().noise
KEPT = report.OUTPUTS / "recovery"

Bounds = Mapping[str, tuple[float, float]]

FEATURE: dict[str, Bounds] = {
    "amplitude": {"amplitude": (50, 150)},
    "centre of the feature": {"centre_x": (60, 100), "centre_y": (30, 70)},
    "scale": {"scale": (15, 35)},
    "exponent": {"exponent": (1.2, 4)},
}
SOURCE: dict[str, Bounds] = {
    "strength of the source": {"source_strength": (5, 40)},
    "place of the source": {"source_x": (90, 130), "source_y": (40, 80)},
    "width of the source": {"source_width": (10, 30)},
    "times of the source": {"source_opens": (0.2, 2), "source_closes": (3, 5.5)},
}
TOGETHER: dict[str, Bounds] = {
    "flow, diffusivity, strength": {"mu": (0, 0.5), "diffusivity": (0.2, 3), "source_strength": (5, 40)},
}
TOGETHER_ADVECTION: dict[str, Bounds] = {
    "six together": {
        "b_x": (-6, 6), "b_y": (-6, 6), "amplitude": (50, 150), "scale": (15, 35),
        "source_strength": (5, 40), "source_width": (10, 30),
    },
}  # fmt: skip
FLOWS: dict[str, tuple[Callable[[Path], Any], list[float], list[float]]] = {
    "double_gyre": (lambda _: DoubleGyre(), [0.0, 0.1], [0.5, 1.3]),
    "uniform": (lambda _: UniformFlow(), [-10, -10], [10, 10]),
    "rotation": (lambda _: SolidRotation(), [-0.3], [0.3]),
    "shear": (lambda _: Shear(), [-8, -0.2], [8, 0.2]),
    "taylor_green": (lambda _: TaylorGreen(), [1, 0], [15, 0.3]),
    "vortices": (lambda _: Vortices(), [-600, -600], [600, 600]),
    "gridded": (lambda folder: GriddedFlow(currents(folder)), [0], [2]),
    "sum": (lambda _: Sum([Vortices([[100, 50]], [40]), UniformFlow()]), [-600, -8, -8], [600, 8, 8]),
    "scaled": (lambda _: Scaled(DoubleGyre()), [0, 0.1, 0.5], [0.5, 1.3, 1.5]),
    "rotated": (lambda _: Rotated(TaylorGreen()), [1, 0, -0.7], [15, 0.3, 0.7]),
}
"""Each flow that is provided, with the bounds of its option."""


def currents(folder: Path) -> Path:
    """A file of currents: the double gyre at three times, on 41 x 21 points."""
    path, flow = folder / "currents.npz", DoubleGyre()
    if not path.exists():
        x, y, t = np.linspace(0, 200, 41), np.linspace(0, 100, 21), np.array([0.0, 3.0, 6.0])
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        uv = np.array([flow.velocity((0.25, 0.6), places, time) for time in t]).reshape(3, 41, 21, 2)
        folder.mkdir(parents=True, exist_ok=True)
        content = io.BytesIO()
        np.savez(content, x=x, y=y, t=t, u=uv[..., 0], v=uv[..., 1])
        atomic.write(path, content.getvalue())  # several processes may be the first
    return path


def kinds(folder: Path = KEPT) -> dict[tuple[str, str], Callable[[], Any]]:
    """What makes the model of each kind of unknown, by experiment and kind."""
    found: dict[tuple[str, str], Callable[[], Any]] = {("advection", "flow"): partial(advection, None)}
    for name, bounds in (FEATURE | SOURCE | TOGETHER_ADVECTION).items():
        found["advection", name] = partial(advection, bounds)
    for name, flow in FLOWS.items():
        found["double_gyre", f"flow {name}"] = partial(with_flow, *flow, folder)
    for name, bounds in ({"diffusivity": {"diffusivity": (0.2, 3)}} | FEATURE | SOURCE | TOGETHER).items():
        found["double_gyre", name] = partial(double_gyre, bounds)
    return found


def advection(bounds: Bounds | None) -> Advection:
    """The first experiment's model with a source."""
    feature, source = (
        InitialFeature(100.0, (80.0, 50.0), 25.0),
        LocalisedSource(20.0, (110.0, 60.0), 20.0, 1.0, 5.0),
    )
    water: dict[str, Any] = {"lower": (-6.0, -6.0), "upper": (6.0, 6.0), "true": (4.0, 2.0)}
    return Advection(initial=feature, source=source, unknown=_named(bounds), **water)


def double_gyre(bounds: Bounds | None, **changed: Any) -> AdvectionDiffusion:
    """The second experiment's model with a source, on a small grid."""
    feature, source = (
        InitialFeature(100.0, (80.0, 50.0), 25.0),
        LocalisedSource(20.0, (110.0, 60.0), 20.0, 1.0, 5.0),
    )
    small = {"cells": (40, 20), "final_time": DURATION, "truth_refinement": 1, "order": 5}
    return AdvectionDiffusion(
        initial=feature,
        source=source,
        unknown=_named(bounds),
        solutions=Solutions(memory=50.0),
        **small | changed,
    )


def with_flow(
    make: Callable[[Path], Any], lower: list[float], upper: list[float], folder: Path
) -> AdvectionDiffusion:
    """The same with another flow, whose parameters are the unknowns."""
    true = [(low + high) / 2 for low, high in zip(lower, upper, strict=True)]
    return double_gyre(None, flow=make(folder), true=true, lower=lower, upper=upper)


def _named(bounds: Bounds | None) -> dict[str, dict[str, float]] | None:
    if bounds is None:
        return None
    return {name: {"lower": low, "upper": high} for name, (low, high) in bounds.items()}


def tried(model: Any, name: tuple[str, str], number: int) -> dict[str, Any]:
    """One truth: how far each unknown is off, and what is told of it."""
    rng, parameters = stream(number, f"recovery {' '.join(name)}"), model.parameters
    true = parameters.centre + parameters.half_width * rng.uniform(-0.9, 0.9, len(parameters))
    positions, times = rng.uniform((0, 0), (200, 100), (SAMPLES, 2)), rng.uniform(0.5, DURATION, SAMPLES)
    if not isinstance(model, Advection):
        times = np.ceil(times)
    values = model.predict(true[None], positions, times)[0] + rng.normal(0, NOISE, SAMPLES)
    samples = Samples.of(positions, times, values)
    estimator = LeastSquares() if isinstance(model, Advection) else Composite()
    problem = FitProblem(model, samples, estimator.tikhonov, leave_one_out=False)
    fit = estimator.fit(problem)
    solved = np.vstack([fit.theta[:1], fit.known]) if len(fit.known) else fit.theta[:1]
    found = assess(problem, fit.theta[0], noise_of(samples, NOISE), solved, SOLVES)
    off = fit.theta[0] - true
    return {
        "true": true.tolist(),
        "estimate": fit.theta[0].tolist(),
        "errors": (np.abs(off) / found.std).tolist(),
        "identified": found.identified.tolist(),
        "held": ((found.interval[:, 0] <= true) & (true <= found.interval[:, 1])).tolist(),
        "several": bool(found.surpassed or len(found.solutions) > 1),
        "solves": int(fit.evaluations),
    }


def verdict_on(one: Mapping[str, Any]) -> str:
    """ "within", "told" or "silent"."""
    far = [k for k, error in enumerate(one["errors"]) if not error <= FAR]
    if not far:
        return "within"
    told = (one["several"] or not one["identified"][k] or one["held"][k] for k in far)
    return "told" if all(told) else "silent"


def row(name: tuple[str, str], trials: list[dict[str, Any]]) -> list[str]:
    """The table's row of one kind."""
    verdicts, count = [verdict_on(one) for one in trials], len(trials)
    silent = [max(one["errors"]) for one, said in zip(trials, verdicts, strict=True) if said == "silent"]
    p = len(trials[0]["errors"])
    chance = count * (1 - math.erf(FAR / math.sqrt(2)) ** p)
    return [
        *name,
        str(p),
        f"{100 * np.mean([all(one['identified']) for one in trials]):.0f} %",
        f"{100 * verdicts.count('within') / count:.1f} %",
        str(verdicts.count("told")),
        f"{len(silent)}" + (f" (at most {max(silent):.1f})" if silent else ""),
        f"{chance:.1f}",
        f"{100 * np.mean([one['held'] for one in trials]):.1f} %",
        f"{np.median([one['solves'] for one in trials]):.0f}",
    ]


COLUMNS = (
    "experiment", "unknown", "p", "all identified", "within 3 std", "told", "silent", "by chance",
    "95 % intervals hold", "solves",
)  # fmt: skip


def trials_of(name: tuple[str, str], make: Callable[[], Any], truths: int, jobs: int) -> list[dict[str, Any]]:
    """The trials of a kind: kept ones, and those that are missing."""
    path = KEPT / f"{'-'.join(name).replace(' ', '_').replace(',', '')}.json"
    kept: list[dict[str, Any]] = []
    if path.exists():
        content = json.loads(path.read_text())
        kept = content["trials"] if content["code"] == package("fieldrl") else []
    missing = range(len(kept), truths)
    chunks: Any = Parallel(jobs)(
        delayed(_chunk)(name, make, part) for part in np.array_split(missing, jobs) if len(part)
    )
    kept += [one for chunk in chunks for one in chunk]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"code": package("fieldrl"), "trials": kept}))
    return kept[:truths]


def _chunk(name: tuple[str, str], make: Callable[[], Any], numbers: NDArray) -> list[dict[str, Any]]:
    with threadpool_limits(1):
        model = make()
        return [tried(model, name, int(number)) for number in numbers]


def main() -> None:
    """Print the table, write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--truths", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", help="kinds whose name holds this text")
    given = parser.parse_args()
    rows, found = [], {}
    for name, make in kinds().items():
        if given.only in " ".join(name):
            trials = trials_of(name, make, given.truths, given.jobs)
            found[" ".join(name)] = trials
            rows.append(row(name, trials))
            print(report.markdown([], rows[-1:]).splitlines()[-1], flush=True)
    report.show(f"{given.truths} truths of each kind, {SAMPLES} samples, noise {NOISE:g}", COLUMNS, rows)
    path = report.write(
        "recovery", {"truths": given.truths, "table": report.markdown(COLUMNS, rows), "trials": found}
    )
    print(f"{path}\n\n{report.markdown(COLUMNS, rows)}")


if __name__ == "__main__":
    main()
