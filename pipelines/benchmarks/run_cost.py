"""What checkpoints and tracking cost a run: the same command without them, with one, with both, side by side.

python -m pipelines.benchmarks.run_cost [REPEATS] [KEY=VALUE ...]

Takes a few minutes.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from typing import Any

from fieldrl.cli.main import main as fieldrl
from fieldrl.runs import checkpoints, job
from pipelines import report

_PLAIN = "--plain"
_COMMANDS = {
    "neither": ("pipelines.benchmarks.run_cost", _PLAIN, "tracking=none"),
    "checkpoints": ("fieldrl.cli.main", "tracking=none"),
    "checkpoints and tracking": ("fieldrl.cli.main", "tracking=mlflow"),
}


class NoCheckpoints(checkpoints.Checkpoints):
    """Keeps nothing: neither the state of a replicate nor its solves."""

    solves: Any = None  # type: ignore[assignment]

    def write(self, number: int, replicate: Any, seconds: float) -> None:
        """Nothing."""


def measure(repeats: int, overrides: Sequence[str]) -> dict[str, list[float]]:
    """Wall time of whole commands, from start to prompt, in turns so that all see the same machine.

    Args:
        repeats: rounds that count; one more, which warms caches and makes the database, does not.
        overrides: of the run's configuration.

    Returns:
        Seconds of each repeat, by what was on.
    """
    found: dict[str, list[float]] = {name: [] for name in _COMMANDS}
    with tempfile.TemporaryDirectory(prefix="fieldrl-") as folder:
        for _ in range(repeats + 1):
            for name, command in _COMMANDS.items():
                started = time.perf_counter()
                shell = [sys.executable, "-m", *command, *overrides, "force=true", f"output_dir={folder}"]
                subprocess.run(shell, check=True, stdout=subprocess.DEVNULL)
                found[name].append(time.perf_counter() - started)
    return {name: seconds[1:] for name, seconds in found.items()}


def main() -> None:
    """Print medians and ranges, write outputs/run_cost.json."""
    repeats, overrides = int(sys.argv[1]) if len(sys.argv) > 1 else 5, sys.argv[2:]
    seconds = measure(repeats, overrides)
    before, rows = next(iter(seconds.values())), []
    for name, values in seconds.items():
        ratios = [one / other for one, other in zip(values, before, strict=True)]
        rows.append((name, _range(values), "" if name == "neither" else _range(ratios)))
        before = values
    title = f"Whole commands, median of {repeats} [least, most]: {' '.join(overrides)}"
    report.show(title, ["with", "seconds", "times the line above"], rows)
    report.write("run_cost", {"overrides": overrides, "seconds": seconds})


def _range(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.3f} [{min(values):.3f}, {max(values):.3f}]"


if __name__ == "__main__":
    if sys.argv[1:2] == [_PLAIN]:
        job.Checkpoints = NoCheckpoints  # type: ignore[misc]
        sys.exit(fieldrl(sys.argv[2:]))
    main()
