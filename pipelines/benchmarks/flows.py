"""What a flow costs: one solve on the experiment's grid, built-in and of one's own.

    python -m pipelines.benchmarks.flows                        ratios to the built-in double gyre
    python -m pipelines.benchmarks.flows --against CHECKOUT     the double gyre, here and there

The second takes CPU seconds of two processes that solve, and do small missions, by turns: whatever else the
machine does counts for both.

Takes a few minutes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np

from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.flow import DoubleGyre, Scaled, TaylorGreen, Vortices

_REPEATS = 7
_TURNS = {"solve": 15, "mission": 5}
_CHILD = """
import sys, time
import gymnasium, numpy as np
import fieldrl
from fieldrl.pde.advection_diffusion import AdvectionDiffusion

model, rng = AdvectionDiffusion(), np.random.default_rng(0)
small = ["pde.cells=[71,36]", "pde.order=5", "pde.solutions.memory=0"]
environment = gymnasium.make("fieldrl/DoubleGyre-v0", overrides=small).unwrapped

def mission():
    environment.reset(seed=0)
    return sum(environment.step(k % 7)[4]["evaluations"] for k in range(5))

for what in sys.stdin:
    theta = [0.25 + 1e-3 * rng.uniform(), 0.6]
    begun = time.process_time()
    solves = mission() if what.strip() == "mission" else len(model.solve(theta)) and 1
    print(time.process_time() - begun, solves, flush=True)
"""
"""Works with every version that has ``AdvectionDiffusion`` and the environment."""


class OwnGyre:
    """The double gyre as an ordinary class, compiled."""

    names, units = ("mu", "omega"), ("1", "rad/time")

    def velocity(self, theta, x, y, t):
        """(u, v)."""
        s = theta[0] * np.sin(theta[1] * t)
        x, y = x / 100.0, y / 100.0
        phase = np.pi * (s * x + 1 - 2 * s) * x
        u = -10.0 * np.pi * np.sin(phase) * np.cos(np.pi * y)
        return u, 10.0 * np.pi * np.cos(phase) * np.sin(np.pi * y) * (2 * s * (x - 1) + 1)


class PythonGyre(OwnGyre):
    """The same with NumPy, not compiled."""

    in_python = True


def main() -> None:
    """Print one of the two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--against", type=Path, help="root of another checkout of fieldrl")
    given = parser.parse_args()
    if given.against is None:
        flows()
    else:
        against(given.against)


def against(checkout: Path) -> None:
    """Print CPU seconds of a solve and of a small mission, here and there, the medians of several turns."""
    here = Path(__file__).parents[2]
    print("| | here | there | ratio |\n|---|---|---|---|")
    with ExitStack() as stack:
        both = [stack.enter_context(_child(root)) for root in (here, checkout.resolve())]
        for what, count in _TURNS.items():
            turns = np.array([[_asked(child, what) for child in both] for _ in range(count + 1)])[1:]
            seconds, solves = np.median(turns[..., 0], axis=0), turns[0, :, 1]
            ratio = np.median(turns[:, 0, 0] / turns[:, 1, 0])
            print(f"| {what} | {seconds[0]:.4f} s | {seconds[1]:.4f} s | {ratio:.3f} |")
            if what == "mission":
                each = seconds / solves
                print(f"| its solves | {solves[0]:.0f} | {solves[1]:.0f} | {solves[0] / solves[1]:.3f} |")
                print(f"| time of each | {each[0]:.5f} s | {each[1]:.5f} s | {each[0] / each[1]:.3f} |")


def _child(root: Path) -> subprocess.Popen[str]:
    """A process that imports fieldrl from there."""
    one = {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(root)}
    return subprocess.Popen(
        [sys.executable, "-c", _CHILD],
        cwd=root, env=os.environ | one, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def _asked(child: subprocess.Popen[str], what: str) -> tuple[float, float]:
    """CPU seconds and solves of one turn."""
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdin.write(what + "\n")
    child.stdin.flush()
    seconds, solves = map(float, child.stdout.readline().split())
    return seconds, solves


def flows() -> None:
    """Print the least time of several solves with each flow, and its ratio to the built-in double gyre's."""
    bounds = partial(AdvectionDiffusion, truth_refinement=1)
    cellular = bounds(flow=TaylorGreen(), true=[8, 0.05], lower=[1, 0], upper=[15, 0.3])
    vortices = bounds(flow=Vortices(), true=[300, -200], lower=[-600] * 2, upper=[600] * 2)
    scaled = bounds(
        flow=Scaled(DoubleGyre()), true=[0.25, 0.6, 1], lower=[0, 0.1, 0.5], upper=[0.5, 1.3, 1.5]
    )
    models = {
        "double_gyre, built in": bounds(),
        "double gyre of one's own, compiled": bounds(flow=OwnGyre()),
        "double gyre of one's own, NumPy": bounds(flow=PythonGyre()),
        "scaled double gyre": scaled,
        "taylor_green": cellular,
        "vortices": vortices,
    }
    seconds = {name: _seconds(model) for name, model in models.items()}
    first = next(iter(seconds.values()))
    print("| flow | time of a solve | ratio |\n|---|---|---|")
    for name, value in seconds.items():
        print(f"| {name} | {value:.3f} s | {value / first:.2f} |")
    theta = np.array([0.25, 0.6])
    difference = models["double gyre of one's own, compiled"].solve(theta) - bounds().solve(theta)
    print(f"\nlargest difference of the field, own and built in: {np.abs(difference).max():.1e}")


def _seconds(model: AdvectionDiffusion) -> float:
    """Least time of a solve [s]."""
    rng, found = np.random.default_rng(0), []
    for _ in range(_REPEATS + 1):
        theta = model.parameters.centre + 0.01 * rng.uniform(-1, 1) * model.parameters.half_width
        begun = time.perf_counter()
        model.solve(theta)
        found.append(time.perf_counter() - begun)
    return min(found[1:])


if __name__ == "__main__":
    main()
