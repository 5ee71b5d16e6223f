"""A black box that costs a second a call: what a fit costs then, and how the calls are spread over threads.

    python examples/slow_model.py

Composite Bayesian optimisation, what ``fieldrl.estimate`` takes for a model of your own, asks as seldom as it
can: one call predicts all samples, and serves every fold of the cross-validation.
"""

import time
from pathlib import Path

import numpy as np

import fieldrl
from fieldrl.core.parameters import Parameters
from fieldrl.estimator.composite import Composite
from fieldrl.figures.estimates import fit_figure


class BlackBox:
    """A plume downwind of a chimney; imagine that a call starts another program and reads what it writes."""

    parameters = Parameters(("wind", "spread"), ("length/time", "1"), (1.0, 0.05), (8.0, 0.5))

    def __init__(self, delay: float):
        self.delay, self.calls = delay, 0

    def predict(self, theta, positions, times):
        """theta (m, 2), positions (n, 2), times (n,) -> (m, n); ``delay`` seconds for each theta."""
        self.calls += len(theta)
        time.sleep(self.delay * len(theta))
        wind, spread = np.asarray(theta).T[:, :, None]
        x, y = positions.T
        width = spread * np.maximum(x, 1.0)
        return 500 / (wind * width) * np.exp(-0.5 * (y / width) ** 2)  # steady: ``times`` do not matter


def main(folder: Path = Path("outputs/examples"), delay: float = 1.0) -> None:
    """Sample the black box at known values with noise, find them again, draw prediction against value."""
    true, rng = np.array([4.0, 0.2]), np.random.default_rng(0)
    places = np.column_stack([rng.uniform(5, 100, 15), rng.uniform(-15, 15, 15)])
    times = rng.uniform(30, 60, 15)
    values = BlackBox(0.0).predict(true[None], places, times)[0] + rng.normal(0, 0.2, 15)
    table = {"time": times, "x": places[:, 0], "y": places[:, 1], "value": values}
    for workers in (1, 2):
        model, began = BlackBox(delay), time.perf_counter()
        found = fieldrl.estimate(table, model, Composite(batch=workers, workers=workers))
        took = time.perf_counter() - began
        print(f"{workers} threads: {model.calls} calls of {delay:g} s in {took:.1f} s\n{found}\n")
    print(f"true: wind = {true[0]:g}, spread = {true[1]:g}")
    folder.mkdir(parents=True, exist_ok=True)
    fit_figure(found.record).savefig(folder / "slow_model.png")


if __name__ == "__main__":
    main()
