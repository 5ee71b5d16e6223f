"""What a flow costs: one solve on the experiment's grid, built-in and of one's own.

python -m pipelines.benchmarks.flows

Takes a few minutes.
"""

from __future__ import annotations

import time
from functools import partial

import numpy as np

from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.flow import DoubleGyre, Scaled, TaylorGreen, Vortices

_REPEATS = 7


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
    """Print a table: the least time of several solves, and its ratio to the built-in double gyre's."""
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
