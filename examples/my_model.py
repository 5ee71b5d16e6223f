"""A model that is not fieldrl's: SciPy's method of lines, with all three estimators.

    python examples/my_model.py

A forward model needs ``parameters`` and ``predict``, nothing else.
"""

import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import RegularGridInterpolator

import fieldrl
from fieldrl.core.parameters import Parameters
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.gaussian_process import GaussianProcess
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.figures.estimates import field_figure


class Bloom:
    """Algae that grow and spread in a basin of 50 km: dc/dt = D lap c + r c (1 - c / 10), walls closed."""

    parameters = Parameters(
        names=("diffusivity", "rate"), units=("km^2/d", "1/d"), lower=(1.0, 0.1), upper=(40.0, 1.0)
    )

    def __init__(self, cells: int = 20):
        self.x = (np.arange(cells) + 0.5) * 50 / cells
        self.start = 3 * np.exp(-((self.x[:, None] - 20) ** 2 + (self.x - 25) ** 2) / 60)

    def solve(self, theta, times):
        """The field at increasing times, (times, cells, cells) [mg/m^3]."""
        diffusivity, rate = theta
        width = self.x[1] - self.x[0]

        def slope(_, c):
            c = c.reshape(self.start.shape)
            wide = np.pad(c, 1, mode="edge")
            around = wide[2:, 1:-1] + wide[:-2, 1:-1] + wide[1:-1, 2:] + wide[1:-1, :-2]
            return (diffusivity * (around - 4 * c) / width**2 + rate * c * (1 - c / 10)).ravel()

        span = (0.0, times[-1] + 1e-9)
        found = solve_ivp(slope, span, self.start.ravel(), t_eval=times, rtol=1e-6, atol=1e-8)
        return found.y.T.reshape(-1, *self.start.shape)

    def predict(self, theta, positions, times):
        """theta (m, 2), positions (n, 2) [km], times (n,) [d] -> (m, n) [mg/m^3]."""
        when, which = np.unique(times, return_inverse=True)
        values = np.empty((len(theta), len(times)))
        for row, one in zip(values, theta, strict=True):
            for k, state in enumerate(self.solve(one, when)):
                field = RegularGridInterpolator((self.x, self.x), state, bounds_error=False, fill_value=None)
                row[which == k] = field(positions[which == k])
        return values


def main(folder: Path = Path("outputs/examples"), samples: int = 12, budget: int = 20) -> None:
    """Sample the model at known values with noise, find them again by every estimator, draw the last."""
    model, true, rng = Bloom(), np.array([12.0, 0.4]), np.random.default_rng(0)
    places, times = rng.uniform(8, 42, (samples, 2)), 1.0 + np.arange(samples) % 6
    values = model.predict(true[None], places, times)[0] + rng.normal(0, 0.1, samples)
    table = {"time": times, "x": places[:, 0], "y": places[:, 1], "value": values}
    estimators = (
        LeastSquares(starts=1),
        GaussianProcess(budget=budget, initial=budget // 2, share=True),
        Composite(),
    )
    for estimator in estimators:
        began = time.perf_counter()
        found = fieldrl.estimate(table, model, estimator)
        took = time.perf_counter() - began
        print(f"{type(estimator).__name__}, {found.fit.evaluations} solves, {took:.1f} s\n{found}\n")
    print(f"true: diffusivity = {true[0]:g}, rate = {true[1]:g}")
    folder.mkdir(parents=True, exist_ok=True)
    field_figure(found.record).savefig(folder / "my_model.png")


if __name__ == "__main__":
    main()
