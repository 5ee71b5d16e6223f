"""What a sweep costs beside its runs: how busy it keeps two workers, and what a finished job takes.

python -m pipelines.benchmarks.sweep_cost [JOBS] [KEY=VALUE ...]

Takes a few minutes.
"""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from fieldrl.cli.compose import composed
from fieldrl.runs.folder import Run
from fieldrl.runs.identity import identity
from pipelines import report

WORKERS = 2
FINISHED = 200
SHORT = ("experiment=advection", "replicates=1", "episodes=20")


def busy(folder: str, jobs: int, overrides: Sequence[str]) -> dict[str, float]:
    """Run a sweep of short runs, tracked, on two workers.

    Returns:
        Wall time of the command, start to prompt [s]; the runs' own seconds, from their summaries [s]; their
        share of two workers' time.
    """
    _timed(folder, 2, [*overrides, "output_dir=warm"])  # compiles the loops where they are not yet
    wall, _ = _timed(folder, jobs, overrides)
    paths = (Path(folder) / "outputs" / "runs").glob("*/summary.json")
    computed = sum(json.loads(path.read_text())["seconds"] for path in paths)
    return {"jobs": jobs, "wall [s]": wall, "runs [s]": computed, "busy": computed / (WORKERS * wall)}


def finished(folder: str, overrides: Sequence[str]) -> dict[str, float]:
    """Run a sweep of which every job is finished: runs of other seeds, copied from one.

    Returns:
        What each further finished job adds to the command: wall and processor time [ms].
    """
    overrides = [*overrides, "tracking=none", "output_dir=finished"]
    path = next((Path(folder) / "outputs" / "runs").glob("*/summary.json"))
    summary = json.loads(path.read_text())
    config = composed(overrides)
    for seed in range(FINISHED):
        run = Run("advection", identity({**config, "seed": seed}), Path(folder) / "finished")
        run.folder.mkdir(parents=True)
        shutil.copy(path.with_name("record.nc"), run.folder)
        (run.folder / "summary.json").write_text(json.dumps(summary | {"key": run.key, "seed": seed}))
    many, one = (min(_timed(folder, jobs, overrides) for _ in range(3)) for jobs in (FINISHED, 1))
    wall, processor = (1000 * (a - b) / (FINISHED - 1) for a, b in zip(many, one, strict=True))
    return {"a finished job [ms]": wall, "a finished job, processor [ms]": processor}


def _timed(folder: str, jobs: int, overrides: Sequence[str]) -> tuple[float, float]:
    """Wall and processor time of the command, its workers included [s]."""
    launcher = ("hydra/launcher=joblib", f"hydra.launcher.n_jobs={WORKERS}")
    command = [sys.executable, "-m", "fieldrl.cli.main", "-m", *overrides, f"seed=range({jobs})", *launcher]
    started, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - started, processor


def main() -> None:
    """Print the costs and write them to outputs/sweep_cost.json."""
    jobs, overrides = int(sys.argv[1]) if len(sys.argv) > 1 else 200, sys.argv[2:] or SHORT
    with tempfile.TemporaryDirectory(prefix="fieldrl-") as folder:
        found = busy(folder, jobs, overrides) | finished(folder, overrides)
    report.show("A sweep on two workers", ["", "value"], [(k, f"{v:.4g}") for k, v in found.items()])
    report.write("sweep_cost", {"costs": found})


if __name__ == "__main__":
    main()
