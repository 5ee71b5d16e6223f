"""A public yardstick: two sources in the plane are found, beside the published numbers of others.

    python -m pipelines.benchmarks.location_finding                   200 roll-outs of each strategy
    python -m pipelines.benchmarks.location_finding --rollouts 2 --measurements 5 --contrasts 1000    seconds

The task is that of Foster et al. 2021 (``sources``): two sources, every coordinate N(0, 1), and 30 sensors
that may lie anywhere. A strategy is worth the information about the sources that it is expected to gain
[nat], which lies between the means of sPCE and sNMC; but sPCE cannot exceed log(L + 1), and where that is
too little sNMC says nothing either. It lies between the means of sACE and sVNMC, too, which have no limit.

The strategies (``placing``):

- random: N(0, 1), as in the paper.
- spread: a fixed design, as dense as the prior (R sequence).
- greedy_information: the agent.
- suggest: the same rule as ``fieldrl suggest`` has it, on a grid of 50 x 50 places within (-4, 4).
- planner: the agent, one step ahead, with a population that covers the places.
- expected_information: not an agent, but made of what is shipped: the information of one sample more,
  expected over draws of what explains the samples (``fieldrl.uncertainty``); rings are about the sources of
  some of them.

All have the same truths, noise and contrasts. What is finished is kept in outputs/location_finding/ until
the code changes. Writes outputs/location_finding.json.

Takes a quarter of an hour.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.runs import atomic
from fieldrl.runs.contents import package
from pipelines import report
from pipelines.benchmarks import placing, sources
from pipelines.benchmarks.placing import STRATEGIES, Chooser, Estimates
from pipelines.benchmarks.sources import (
    NOISE,
    UNKNOWNS,
    Near,
    bounds,
    distance,
    log_likelihoods,
    means,
    places,
)

MEASUREMENTS, CONTRASTS = 30, 500_000  # of the paper; its evaluation has 500,000 contrasts
NEAR = 20_000  # contrasts near what explains the samples
KEPT = report.OUTPUTS / "location_finding"
PART = 20  # roll-outs that are kept together

BOUNDS = ("sPCE", "sNMC", "sACE", "sVNMC")
COLUMNS = ("strategy", "roll-outs", *BOUNDS, "error", "seconds")
PUBLISHED = (
    ("random [1]", "2048", "8.303 ± 0.043", "8.322 ± 0.045", 0.0026),
    ("fixed [1]", "2048", "8.838 ± 0.039", "8.914 ± 0.038", 0.0018),
    ("variational [1]", "256", "8.776 ± 0.143", "9.064 ± 0.187", 8963.2),
    ("DAD [1]", "2048", "10.926 ± 0.036", "12.382 ± 0.095", 0.0474),
    ("VPCE [2]", "1000", "7.766 ± 0.069", "7.802 ± 0.072", None),
    ("DAD [2]", "2000", "10.965 ± 0.041", "12.380 ± 0.086", None),
    ("RL [2]", "2000", "11.73 ± 0.040", "12.362 ± 0.062", None),
)
"""Others' figures of this task, with the seconds that all 30 decisions took on their machines."""

SOURCES = """\
[1] Foster, Ivanova, Malik, Rainforth 2021, arXiv 2103.02438, table 1 and appendix D.1; L = 500,000.
[2] Blau, Bonilla, Chades, Dezfouli 2022, arXiv 2202.00821, table 1; L = 1,000,000, sensors within (-4, 4)."""


def rollout(choose: Chooser, number: int, measurements: int, contrasts: int) -> dict[str, float]:
    """One roll-out: the four bounds [nat], the error [length], what a decision took [s of the processor]."""
    truth = stream(number, "sources").standard_normal((1, UNKNOWNS))
    noise = NOISE * stream(number, "noise of the sensors").standard_normal(measurements)
    rng, samples, seconds = stream(number, "choices"), Samples.none(), 0.0
    for i in range(measurements):
        begun = time.process_time()
        sensor = choose(samples, measurements - i, rng)
        seconds += time.process_time() - begun
        samples = samples.append(sensor, i + 1.0, means(truth, sensor[None])[0, 0] + noise[i])
    return judged(samples, truth, number, contrasts) | {"seconds": seconds / measurements}


def judged(samples: Samples, truth: NDArray, number: int, contrasts: int) -> dict[str, float]:
    """What samples tell of the truth (1, 4): the four bounds [nat], the error of the estimate [length]."""
    taken = samples.positions, samples.values
    of_truth = float(log_likelihoods(truth, *taken)[0])
    others = stream(number, "contrasts").standard_normal((contrasts, UNKNOWNS))
    found = bounds(of_truth, log_likelihoods(others, *taken))
    explaining = places(Estimates().assessed(samples).solutions)
    near = Near(explaining, samples.positions)
    others = near.drawn(NEAR, stream(number, "contrasts nearby"))
    weighted = log_likelihoods(others, *taken) + near.log_weight(others)
    found += bounds(of_truth, weighted, float(near.log_weight(truth)[0]))
    return dict(zip(BOUNDS, found, strict=True)) | {"error": distance(explaining[0], truth[0])}


def rollouts(name: str, count: int, measurements: int, contrasts: int, jobs: int) -> list[dict[str, float]]:
    """The roll-outs of a strategy: kept ones, and those that are missing."""
    firsts = range(0, count, PART)
    parts: Any = Parallel(jobs)(
        delayed(_part)(name, range(first, min(first + PART, count)), measurements, contrasts)
        for first in firsts
    )
    return [one for part in parts for one in part]


def _part(name: str, numbers: range, measurements: int, contrasts: int) -> list[dict[str, float]]:
    """Some roll-outs, kept together."""
    path = KEPT / f"{name}-{measurements}-{contrasts}-{numbers[0]}.json"
    kept: list[dict[str, float]] = []
    if path.exists():
        content = json.loads(path.read_text())
        kept = content["rollouts"] if content["code"] == _code() else []
    if len(kept) < len(numbers):
        with threadpool_limits(1):
            choose = STRATEGIES[name]()
            kept += [rollout(choose, number, measurements, contrasts) for number in numbers[len(kept) :]]
        atomic.write(path, json.dumps({"code": _code(), "rollouts": kept}))
    return kept[: len(numbers)]


def _code() -> list[str]:
    """What the roll-outs follow from: digests of fieldrl, the strategies, and the model with its bounds."""
    return [package(name) for name in ("fieldrl", placing.__name__, sources.__name__)]


def row(name: str, found: Sequence[dict[str, float]]) -> tuple[str, ...]:
    """The table's line of a strategy: means with standard errors, median error, mean seconds a decision."""
    each = np.array([[one[bound] for one in found] for bound in BOUNDS])
    errors = each.std(axis=1, ddof=1) / math.sqrt(len(found))
    of_bounds = [f"{mean:.2f} ± {error:.2f}" for mean, error in zip(each.mean(axis=1), errors, strict=True)]
    off, seconds = np.median([one["error"] for one in found]), np.mean([one["seconds"] for one in found])
    return (name, str(len(found)), *of_bounds, f"{off:.2g}", f"{seconds:.2g}")


def published() -> list[tuple[str, ...]]:
    """The lines of others."""
    return [(*line, "", "", "", "" if s is None else f"{s / MEASUREMENTS:.3g}") for *line, s in PUBLISHED]


def main() -> None:
    """Print the table, write it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rollouts", type=int, default=200)
    parser.add_argument("--measurements", type=int, default=MEASUREMENTS)
    parser.add_argument("--contrasts", type=int, default=CONTRASTS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", choices=STRATEGIES, help="one strategy alone")
    given = parser.parse_args()
    setting = given.measurements, given.contrasts
    names = [given.only] if given.only else list(STRATEGIES)
    found = {name: rollouts(name, given.rollouts, *setting, given.jobs) for name in names}
    table = [row(name, several) for name, several in found.items()]
    if given.measurements == MEASUREMENTS:
        table += published()
    title = (
        f"{given.measurements} sensors: information [nat], mean ± standard error; error [length], median; "
        f"seconds a decision; L = {given.contrasts:,} (sPCE <= {math.log(given.contrasts + 1):.3f}), "
        f"{NEAR:,} of sACE"
    )
    report.show(title, COLUMNS, table)
    content = {"setting": vars(given), "table": report.markdown(COLUMNS, table), "rollouts": found}
    print(f"{SOURCES}\n{report.write('location_finding', content)}\n\n{content['table']}")


if __name__ == "__main__":
    main()
