"""What tracking costs a run: the same command with and without MLflow, side by side.

python -m pipelines.tracking_cost [REPEATS] [KEY=VALUE ...]
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence


def measure(repeats: int = 5, overrides: Sequence[str] = ()) -> dict[str, list[float]]:
    """Wall time of whole commands, from start to prompt, alternating so that both see the same machine.

    Args:
        repeats: pairs that count; one more, which warms caches and makes the database, does not.
        overrides: of the run's configuration.

    Returns:
        "none" and "mlflow", seconds of each repeat, and "ratio" mlflow / none, (repeats,) each.
    """
    found: dict[str, list[float]] = {"none": [], "mlflow": []}
    with tempfile.TemporaryDirectory(prefix="fieldrl-") as folder:
        for _ in range(repeats + 1):
            for tracking, seconds in found.items():
                seconds.append(_timed([*overrides, f"tracking={tracking}", f"output_dir={folder}"]))
    found = {name: seconds[1:] for name, seconds in found.items()}
    ratios = [with_it / without for with_it, without in zip(found["mlflow"], found["none"], strict=True)]
    return found | {"ratio": ratios}


def _timed(overrides: Sequence[str]) -> float:
    command = [sys.executable, "-m", "fieldrl.app.main", "force=true", *overrides]
    started = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - started


def main() -> None:
    """Print the medians and the spread."""
    repeats, overrides = int(sys.argv[1]) if len(sys.argv) > 1 else 5, sys.argv[2:]
    for name, values in measure(repeats, overrides).items():
        unit = "" if name == "ratio" else " s"
        print(f"{name:<7} {statistics.median(values):.3f}{unit}  [{min(values):.3f}, {max(values):.3f}]")


if __name__ == "__main__":
    main()
