"""How well what a run takes is estimated: memory and time of whole replicates, beside what is measured.

python -m pipelines.benchmarks.estimates

One replicate of each configuration, in a process of its own that has done a short one before, so that imports
and compiling are not counted. Memory is the growth of the process's greatest resident size; time is that of
the processor.

Takes ten minutes.
"""

from __future__ import annotations

import resource
import sys
import time
from dataclasses import replace
from multiprocessing import get_context
from multiprocessing.connection import Connection

from fieldrl.cli.compose import composed
from fieldrl.mission import run_replicate
from fieldrl.mission.needs import BUDGET, needs
from fieldrl.runs import components
from fieldrl.runs.components import mission
from pipelines import report

CONFIGURATIONS = (
    ("experiment=advection",),
    ("experiment=advection", "steps=60", "episodes=200", "estimator.grid=101"),
    ("experiment=advection", "agent.tile_coding.tiles=[600,600]", "episodes=200"),
    ("experiment=advection", "estimator=gaussian_process", "episodes=1", "steps=4"),
    ("experiment=advection", "estimator=composite", "episodes=20"),
    ("experiment=double_gyre",),
    ("experiment=double_gyre", "pde.cells=[284,142]", "episodes=2"),
)


def estimated(overrides: tuple[str, ...]) -> tuple[float, float]:
    """Bytes and seconds of one replicate."""
    config = composed(overrides)
    part = {name: components.build(config[name], name) for name in ("pde", "vehicle", "agent", "estimator")}
    budget = {key: config[key] for key in BUDGET} | {"replicates": 1}
    costs = needs(part.pop("pde"), **part, budget=budget, processes=1).values()
    return sum(cost.memory for cost in costs), sum(cost.seconds for cost in costs)


def measured(overrides: tuple[str, ...]) -> tuple[float, float]:
    """The same, as they are."""
    here, there = get_context("spawn").Pipe()
    process = get_context("spawn").Process(target=_measure, args=(overrides, there))
    process.start()
    there.close()
    found = here.recv()
    process.join()
    return found


def _measure(overrides: tuple[str, ...], pipe: Connection) -> None:
    small = ("pde.cells=[36,18]",) if "experiment=double_gyre" in overrides else ()
    plain = tuple(
        item for item in overrides if not item.startswith(("pde.cells", "agent.tile", "estimator.grid"))
    )
    short = mission(composed((*plain, *small)))
    run_replicate(replace(short, episodes=1, steps=3, evaluation_episodes=1), 0, 0)
    before, started = _resident(), time.process_time()
    run_replicate(mission(composed(overrides)), 0, 0)
    pipe.send((_resident() - before, time.process_time() - started))


def _resident() -> float:
    """Greatest resident size so far [bytes]."""
    unit = 1 if sys.platform == "darwin" else 1024
    return unit * float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def main() -> None:
    """Print the table, write outputs/estimates.json."""
    rows, found = [], []
    for overrides in CONFIGURATIONS:
        memory, seconds = estimated(overrides)
        real_memory, real_seconds = measured(overrides)
        each = (memory / 1e6, real_memory / 1e6, seconds, real_seconds, seconds / real_seconds)
        rows.append((" ".join(overrides), *(f"{value:.3g}" for value in each)))
        found.append(
            {"overrides": overrides, "estimated": [memory, seconds], "measured": [real_memory, real_seconds]}
        )
    columns = ("one replicate", "MB estimated", "measured", "s estimated", "measured", "ratio")
    report.show("What a run takes", columns, rows)
    report.write("estimates", {"configurations": found})


if __name__ == "__main__":
    main()
