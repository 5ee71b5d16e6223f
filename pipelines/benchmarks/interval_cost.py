"""What intervals, regions and the field's standard deviation cost a run: time, and solves at its end.

    python -m pipelines.benchmarks.interval_cost

Takes two minutes.
"""

from __future__ import annotations

import time
from typing import Any
from unittest.mock import patch

from fieldrl.cli.compose import composed
from fieldrl.mission import record as recording
from fieldrl.mission.learning import Replicate
from fieldrl.runs.components import mission
from pipelines import report

RUNS = {"advection": (), "double_gyre": ("episodes=40", "evaluation_episodes=1")}
"""What differs from the experiment: of the gyres a short run, whose end weighs more than a long one's."""


def measure(experiment: str, overrides: tuple[str, ...]) -> dict[str, Any]:
    """One replicate: its time without uncertainty, what that takes, and how many solves it makes [s]."""
    whole = mission(composed([f"experiment={experiment}", *overrides]))
    replicate, spent = Replicate(whole, 0, 0), {"seconds": 0.0, "solves": 0}
    assessed, store = recording.uncertainty_variables, getattr(whole.water, "solutions", None)

    def timed(*arguments: Any) -> dict[str, Any]:
        started, solves = time.perf_counter(), store.solves if store else 0
        found = assessed(*arguments)
        spent["seconds"] += time.perf_counter() - started
        spent["solves"] += (store.solves if store else 0) - solves
        return found

    started = time.perf_counter()
    while not replicate.finished:
        replicate.advance()
    with patch.object(recording, "uncertainty_variables", timed):
        replicate.record()
        total = time.perf_counter() - started - spent["seconds"]
        spent.update(seconds=0.0, solves=spent["solves"])
        first = spent["solves"]
        replicate.record()  # again, for what is compiled or loaded once is no part of it
    return {"without": total, "seconds": spent["seconds"], "solves": first}


def main() -> None:
    """Print and keep what it costs."""
    rows, found = [], {}
    for experiment, overrides in RUNS.items():
        one = found[experiment] = measure(experiment, overrides)
        share = 100 * one["seconds"] / one["without"]
        title = " ".join((experiment, *overrides))
        rows.append(
            (title, f"{one['without']:.2f}", f"{one['seconds']:.2f}", f"{share:.1f}", str(one["solves"]))
        )
    columns = ["one replicate", "without [s]", "uncertainty [s]", "more [%]", "solves"]
    report.show("What uncertainty costs", columns, rows)
    report.write("interval_cost", found)


if __name__ == "__main__":
    main()
