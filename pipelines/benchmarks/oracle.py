"""The double gyre in py-pde: second-order central differences, an oracle and a yardstick for the solver.

Twice: as py-pde's manual writes an equation, by an expression, and with a right-hand side in which the flow's
factors are computed once per evaluation, about the best that a careful user of py-pde would compile by hand.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pde import (  # pyright: ignore[reportMissingImports]
    PDE,
    CartesianGrid,
    PDEBase,
    RungeKuttaSolver,
    ScalarField,
)
from pde.tools.config import config  # pyright: ignore[reportMissingImports]

from fieldrl.pde.advection_diffusion import AdvectionDiffusion

_MARGIN = 0.7  # share of the stability limit of classical Runge-Kutta, 2 sqrt(2)


class GyreEquation(PDEBase):
    """dc/dt = rho lap c - v grad c with the double gyre's v."""

    def __init__(self, model: AdvectionDiffusion, theta: NDArray) -> None:
        super().__init__()
        self.model, self.theta = model, theta

    def evolution_rate(self, state: Any, t: float = 0) -> Any:
        """The right-hand side in NumPy."""
        points = state.grid.cell_coords.reshape(-1, 2)
        v = self.model.flow.velocity(self.theta, points, t).T.reshape(2, *state.data.shape)
        slope = state.gradient({"derivative": 0}).data
        rate = (
            self.model.diffusivity * state.laplace({"derivative": 0}).data - v[0] * slope[0] - v[1] * slope[1]
        )
        return ScalarField(state.grid, rate)

    def make_evolution_rate(self, state: Any, backend: Any) -> Any:
        """The right-hand side, compiled."""
        wall: Any = {"derivative": 0}
        laplace = state.grid.make_operator("laplace", bc=wall, backend=backend, dtype=state.dtype)
        gradient = state.grid.make_operator("gradient", bc=wall, backend=backend, dtype=state.dtype)
        rho, (mu, omega) = self.model.diffusivity, self.theta
        flow: Any = self.model.flow
        amplitude, length = flow.constants
        x, y = (np.asarray(axis) / length for axis in state.grid.axes_coords)
        sine, cosine, speed = np.sin(np.pi * y), np.cos(np.pi * y), np.pi * amplitude * length

        def rate(c, t=0.0):
            s = mu * np.sin(omega * t)
            phase = np.pi * (s * x + 1 - 2 * s) * x
            u, v = -speed * np.sin(phase), speed * np.cos(phase) * (2 * s * (x - 1) + 1)
            slope, out = gradient(c), laplace(c)
            for i in range(c.shape[0]):
                for j in range(c.shape[1]):
                    flux = u[i] * cosine[j] * slope[0, i, j] + v[i] * sine[j] * slope[1, i, j]
                    out[i, j] = rho * out[i, j] - flux
            return out

        return rate


def written(model: AdvectionDiffusion, theta: NDArray) -> Any:
    """The same equation as an expression of py-pde's."""
    flow: Any = model.flow
    (amplitude, length), (mu, omega) = map(float, flow.constants), map(float, theta)
    x, y, s = f"(x/{length})", f"(y/{length})", f"({mu}*sin({omega}*t))"
    phase, speed = f"pi*({s}*{x}+1-2*{s})*{x}", float(np.pi * amplitude * length)
    u = f"-{speed}*sin({phase})*cos(pi*{y})"
    v = f"{speed}*cos({phase})*sin(pi*{y})*(2*{s}*({x}-1)+1)"
    rate = f"{float(model.diffusivity)}*laplace(c) - ({u})*d_dx(c) - ({v})*d_dy(c)"
    return PDE({"c": rate}, bc={"derivative": 0})


def time_step(model: AdvectionDiffusion, theta: NDArray, cells: tuple[int, int]) -> float:
    """A stable step of the classical Runge-Kutta method with central differences [time]."""
    h = np.subtract(model.domain.upper, model.domain.lower) / cells
    points = model.domain.grid(100, 50).points
    speed = max(
        (np.abs(model.flow.velocity(theta, points, t)) / h).sum(axis=1).max()
        for t in np.linspace(0, model.final_time, 41)
    )
    return _MARGIN * min(2 * np.sqrt(2) / speed, 2.78 / (4 * model.diffusivity * np.sum(1 / h**2)))


def solve(
    model: AdvectionDiffusion,
    theta: NDArray,
    cells: tuple[int, int],
    repeats: int = 1,
    backend: str = "numba",
    equation: Callable[[AdvectionDiffusion, NDArray], Any] = GyreEquation,
) -> tuple[NDArray[np.float64], float, float]:
    """The field at the final time by py-pde, at the cells' centres.

    Args:
        model: the problem; its grid is not used.
        theta: (mu, omega), (2,).
        cells: py-pde's grid.
        repeats: of the timed solve.
        backend: of py-pde; "scipy" compiles nothing, but is slow.
        equation: GyreEquation, compiled by hand, or ``written``.

    Returns:
        the field (nx, ny), CPU seconds of the solve alone, CPU seconds with compilation.
    """
    config["backend.numba.multithreading"] = "never"
    bounds = list(zip(model.domain.lower, model.domain.upper, strict=True))
    grid: Any = CartesianGrid(bounds, list(cells))
    steps = int(np.ceil(model.final_time / time_step(model, theta, cells)))
    step = model.final_time / steps

    def start() -> Any:
        return ScalarField(grid, model.initial.value(grid.cell_coords.reshape(-1, 2)).reshape(cells))

    began = time.process_time()
    stepper = RungeKuttaSolver(equation(model, theta), backend=backend).make_stepper(start(), dt=step)
    stepper(start(), 0.0, step)
    compiling, spent, state = time.process_time() - began, np.inf, start()
    for _ in range(repeats):
        state, began = start(), time.process_time()
        stepper(state, 0.0, model.final_time)
        spent = min(spent, time.process_time() - began)
    return state.data, spent, spent + compiling
