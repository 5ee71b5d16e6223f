"""What a sweep costs beside its runs: how busy it keeps two workers, and what a finished job takes.

python -m pipelines.sweep_cost [JOBS] [KEY=VALUE ...]
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from pipelines import report

WORKERS = 2
SHORT = ("experiment=advection", "replicates=1", "episodes=20")


def measure(jobs: int, overrides: Sequence[str] = SHORT) -> dict[str, float]:
    """Run a sweep of short runs, tracked, on two workers; then again, when all of it is finished.

    Args:
        jobs: how many runs, >= 2.
        overrides: of each.

    Returns:
        "first": the first command, start to prompt [s]; "runs": the runs' own seconds, from their summaries
        [s]; "busy": their share of two workers' time; "again": the same command, everything finished [s];
        "one": a sweep of one finished job [s]; "each further": what each further job adds to that [ms].
    """
    with tempfile.TemporaryDirectory(prefix="fieldrl-") as folder:
        _timed(folder, 2, [*overrides, "output_dir=warm"])  # compiles the loops where they are not yet
        first = _timed(folder, jobs, overrides)
        computed = _seconds(Path(folder) / "outputs" / "runs")
        again = min(_timed(folder, jobs, overrides) for _ in range(3))
        _timed(folder, 1, overrides)
        one = min(_timed(folder, 1, overrides) for _ in range(3))
    return {
        "jobs": jobs,
        "first": first,
        "runs": computed,
        "busy": computed / (WORKERS * first),
        "again": again,
        "one": one,
        "each further": 1000 * (again - one) / (jobs - 1),
    }


def _timed(folder: str, jobs: int, overrides: Sequence[str]) -> float:
    launcher = ("hydra/launcher=joblib", f"hydra.launcher.n_jobs={WORKERS}")
    command = [sys.executable, "-m", "fieldrl.app.main", "-m", *overrides, f"seed=range({jobs})", *launcher]
    started = time.perf_counter()
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - started


def _seconds(runs: Path) -> float:
    return sum(json.loads(path.read_text())["seconds"] for path in runs.glob("*/summary.json"))


def main() -> None:
    """Print the costs and write them to outputs/sweep_cost.json."""
    found = measure(int(sys.argv[1]) if len(sys.argv) > 1 else 200, sys.argv[2:] or SHORT)
    units = {"first": " s", "runs": " s", "again": " s", "one": " s", "each further": " ms"}
    rows = [(name, f"{value:.4g}{units.get(name, '')}") for name, value in found.items()]
    report.show("A sweep on two workers", ["", "value"], rows)
    report.write("sweep_cost", {"costs": found})


if __name__ == "__main__":
    main()
