"""A flow of your own: a meandering jet, whose speed and wave number samples of a tracer tell.

python examples/my_flow.py
"""

from pathlib import Path

import numpy as np

import fieldrl
from fieldrl.figures.estimates import field_figure
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.initial import InitialFeature


class Meander:
    """A jet along a wave; a streamfunction keeps the water free of divergence, and solves quick."""

    names, units = ("speed", "waves"), ("length/time", "1")

    def __init__(self, width: float = 25.0, swing: float = 15.0):
        self.width, self.swing = width, swing

    def streamfunction(self, theta, x, y, t):
        """psi with v = (-dpsi/dy, dpsi/dx)."""
        axis = 50.0 + self.swing * np.sin(2 * np.pi * theta[1] * x / 200.0)
        return -theta[0] * self.width * np.tanh((y - axis) / self.width)

    def velocity(self, theta, x, y, t):
        """(u, v) at the positions x, y."""
        wave = 2 * np.pi * theta[1] / 200.0
        away = (y - 50.0 - self.swing * np.sin(wave * x)) / self.width
        speed = theta[0] / np.cosh(away) ** 2
        return speed, speed * self.swing * wave * np.cos(wave * x)


def main(folder: Path = Path("outputs/examples"), cells: tuple[int, int] = (64, 32)) -> None:
    """Sample the model at known values with noise, find them again, draw the estimated field."""
    feature = InitialFeature(centre=(50.0, 55.0), scale=20.0)
    true = np.array([9.0, 1.5])
    model = AdvectionDiffusion(
        flow=Meander(), true=true, lower=(4.0, 0.5), upper=(14.0, 2.5), initial=feature, cells=cells
    )
    rng = np.random.default_rng(1)
    times = np.linspace(1.0, 10.0, 16)
    positions = np.column_stack([50 + 8 * times, 55 + 25 * np.sin(2 * times)]) + rng.normal(0, 3, (16, 2))
    values = model.predict(true[None], positions, times)[0] + rng.normal(0, 1.0, times.size)
    x, y = positions.T
    found = fieldrl.estimate({"time": times, "x": x, "y": y, "value": values}, model)
    print(f"true: speed = {true[0]:g}, waves = {true[1]:g}; samples with noise of 1 say\n{found}")
    folder.mkdir(parents=True, exist_ok=True)
    field_figure(found.record).savefig(folder / "my_flow.png")


if __name__ == "__main__":
    main()
