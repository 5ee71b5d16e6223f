"""What a run survives: what is likely to happen to it happens, and results are compared bit for bit.

python -m pipelines.faults [--kills 50] [--most N] [--only CASE ...] [--short]

Cases that ran before stay in outputs/faults.json, so that the table can be filled in pieces.

Takes half an hour.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from pipelines import report
from pipelines.faults import cases
from pipelines.faults.bench import Bench, Outcome

Case = Callable[[Bench, int], Outcome]

CASES: dict[str, tuple[str, Case, int, int]] = {
    "kill": ("SIGKILL at a random moment, a run", cases.kills, 35, 2),
    "sweep": ("SIGKILL at a random moment, a sweep", partial(cases.kills, commands=[cases.SWEEP]), 15, 1),
    "write": ("SIGKILL while a file is written", cases.writing, 20, 3),
    "interrupt": ("Ctrl-C", cases.interrupts, 4, 1),
    "worker": ("a worker is killed", cases.dead_worker, 3, 1),
    "worker twice": ("a worker is killed, and again", partial(cases.dead_worker, times=2), 2, 0),
    "sweep worker": (
        "a worker of a sweep is killed",
        partial(cases.dead_worker, arguments=cases.SLOW_SWEEP),
        3,
        0,
    ),
    "first use": ("first use by 8 processes at once", cases.first_use, 20, 0),
    "same run": ("two processes, one run", cases.same_run, 3, 1),
    "locked": ("database locked for 30 s", cases.locked_database, 1, 0),
    "full": ("full disk", partial(cases.disk, ending="full"), 2, 1),
    "read-only": ("read-only output folder", partial(cases.disk, ending="read-only"), 2, 1),
    "no number": ("solver gives no number for a quarter", cases.no_number, 2, 1),
    "checkpoint": ("garbled checkpoint", partial(cases.garbled, what="replicate"), 4, 1),
    "record": ("garbled record", partial(cases.garbled, what="record.nc"), 4, 1),
    "summary": ("garbled summary", partial(cases.garbled, what="summary.json"), 4, 1),
    "solves": ("garbled store of solves", partial(cases.garbled, what="solves"), 4, 1),
}
"""By name: what happens, the case, how often in full, how often in short."""


def measure(bench: Bench, name: str, count: int) -> dict[str, Any]:
    """One case, so many times: its outcome and how long it took [s]."""
    what, case, *_ = CASES[name]
    started = time.monotonic()
    outcome = case(bench, count)
    took = round(time.monotonic() - started, 1)
    return {"what": what, "count": count, **asdict(outcome), "took": took}


def warm() -> None:
    """Import and compile, once for all victims."""
    import fieldrl.figures
    import fieldrl.runs.job  # noqa: F401
    from fieldrl.cli.compose import composed
    from fieldrl.mission import run_replicate
    from fieldrl.runs.components import mission

    for experiment in ("advection", "double_gyre"):
        small = ["episodes=1", "steps=2", "evaluation_episodes=1"]
        run_replicate(mission(composed([f"experiment={experiment}", *small])), 0, 0)


def _count(name: str, short: bool, kills: int, most: int) -> int:
    _, _, full, few = CASES[name]
    if short:
        return few
    return min(most, round(full * kills / 50) if name in ("kill", "sweep") else full)


def _keep(name: str, case: dict[str, Any]) -> dict[str, Any]:
    """Add a case to those in outputs/faults.json; returns them all."""
    path = report.OUTPUTS / "faults.json"
    known = json.loads(path.read_text())["cases"] if path.exists() else {}
    known[name] = case
    table = {each: known[each] for each in CASES if each in known}
    report.write("faults", {"cases": table})
    return table


def main() -> None:
    """Run the cases that are asked for, show the whole table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50, help="SIGKILLs at random moments")
    parser.add_argument("--most", type=int, default=1000, help="no case more often than this")
    parser.add_argument("--only", nargs="*", choices=list(CASES), default=list(CASES))
    parser.add_argument("--short", action="store_true")
    options = parser.parse_args()
    folder, table = Path(tempfile.mkdtemp(prefix="fieldrl-faults-")), {}
    warm()
    try:
        bench = Bench(folder)
        for name in options.only:
            count = _count(name, options.short, options.kills, options.most)
            if count:
                table = _keep(name, measure(bench, name, count))
                print(f"{CASES[name][0]}: {table[name]['took']} s", *table[name]["trouble"], sep="\n  ")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    numbers = ("count", "same", "differ", "lost", "lines", "said")
    rows = [(case["what"], *(case[name] for name in numbers)) for case in table.values()]
    report.show("Faults", ("", "times", "same", "differ", "lost", "lines", "what the user saw"), rows)


if __name__ == "__main__":
    main()
