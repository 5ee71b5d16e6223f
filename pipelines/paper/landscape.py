"""The misfit over (mu, omega): its local minima, and the points that the Bayesian optimisation has solved.

python -m pipelines.paper.landscape [scale=small]

Takes a minute, and its run four.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from joblib import Parallel, delayed
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import ForwardModel
from fieldrl.figures import style
from fieldrl.pde.solutions import Solutions
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import gyres

SIDE = {"paper": 41, "small": 6}  # points of the map along each parameter
_MEMORY = 16  # of solves, they are not asked for again [MB]
_SAME = 1e-2  # minima closer than this are one, in widths of the bounds


def plan(settings: Settings) -> dict[str, Wanted]:
    """The run of table 2."""
    return gyres.PLAN


def make(settings: Settings) -> None:
    """Find the run, map the misfit of the best episode of replicate 0, draw."""
    run = experiments.find(plan(settings), settings)[gyres.RUN]
    episode = int(run.record["best_episode"][0])
    counts = sorted({min(3, run.record.sizes["step"]), run.record.sizes["step"]})
    parts = [run.key, SIDE[settings.scale], counts]
    found = experiments.kept(settings, "landscape", parts, lambda: _mapped(settings, run, episode, counts))
    drawing = style.figure(style.PAGE, 3.1)
    panels = style.panels(drawing, len(counts), shared=True)
    norm = LogNorm(float(found["e_f"].min()), float(found["e_f"].max()))
    image = None
    for axes, n in zip(panels, counts, strict=True):
        image = _draw(axes, run, found, n, episode, norm)
    panels[0].set_ylabel(style.quantity("$\\omega$", "rad/time"), fontsize=style.TEXT)
    style.legend_across(drawing, panels[-1])
    if image is not None:
        style.colour_bar(image, panels[-1], "$e_f$ [(field unit)$^2$]")
    numbers = _numbers(found, counts)
    artefacts.save(settings, "landscape", drawing, _caption(run, episode, numbers), [run], numbers)


def minima(found: xr.Dataset, n: int) -> tuple[NDArray, NDArray]:
    """Local minima of e_f of the first n samples, least first: theta (k, 2) and e_f (k,)."""
    rows = found.sel(samples=n)
    known = np.isfinite(rows["minimum_loss"].values)
    theta, loss = rows["minimum"].values[known], rows["minimum_loss"].values[known]
    order = np.argsort(loss)
    return theta[order], loss[order]


def _mapped(settings: Settings, run: Found, episode: int, counts: list[int]) -> xr.Dataset:
    """e_f of the first n samples on a grid of theta, and its minima refined, for every n in ``counts``."""
    samples = samples_of(run.record, 0, episode)
    water: Any = run.mission.water
    model = replace(water, solutions=Solutions(memory=_MEMORY))
    parameters = model.parameters
    sides = [
        np.linspace(*bounds, SIDE[settings.scale])
        for bounds in zip(parameters.lower, parameters.upper, strict=True)
    ]
    tasks = [np.column_stack([np.full(sides[1].size, mu), sides[1]]) for mu in sides[0]]
    run_all = Parallel(n_jobs=min(settings.workers, len(tasks)))
    predictions = run_all(delayed(model.predict)(task, samples.positions, samples.times) for task in tasks)
    squares = (np.array(list(predictions)) - samples.values) ** 2  # (mu, omega, sample)
    e_f = np.stack([squares[..., :n].mean(axis=-1) for n in counts])
    refined = [_refined(run_all, model, samples, n, sides, loss) for n, loss in zip(counts, e_f, strict=True)]
    longest = max(len(theta) for theta, _ in refined)
    theta, loss = np.full((len(counts), longest, 2), np.nan), np.full((len(counts), longest), np.nan)
    for k, (places, values) in enumerate(refined):
        theta[k, : len(places)], loss[k, : len(places)] = places, values
    return xr.Dataset(
        {
            "e_f": (("samples", "mu", "omega"), e_f, {"units": "field unit^2"}),
            "minimum": (("samples", "number", "parameter"), theta),
            "minimum_loss": (("samples", "number"), loss, {"units": "field unit^2"}),
        },
        {"samples": counts, "mu": sides[0], "omega": sides[1]},
    )


def samples_of(record: xr.Dataset, replicate: int, episode: int) -> Samples:
    """What the vehicle measured in an episode."""
    run = record.isel(replicate=replicate, episode=episode)
    return Samples.of(run["measured_position"].values, run["time"].values, run["value"].values)


def _refined(
    run_all: Parallel, model: ForwardModel, samples: Samples, n: int, sides: list[NDArray], loss: NDArray
) -> tuple[NDArray, NDArray]:
    """Descents from the map's minima; those that end at one place are one."""
    first = Samples.of(samples.positions[:n], samples.times[:n], samples.values[:n])
    starts = [np.array([sides[0][i], sides[1][j]]) for i, j in grid_minima(loss)]
    ends: Any = run_all(delayed(_descend)(model, first, start) for start in starts)
    places: list[NDArray] = []
    values: list[float] = []
    width = 2 * model.parameters.half_width
    for theta, value in sorted(ends, key=lambda end: end[1]):
        if all(np.abs((theta - place) / width).max() > _SAME for place in places):
            places.append(theta)
            values.append(value)
    return np.array(places), np.array(values)


def grid_minima(loss: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Places of a map (a, b) that lie below all of their up to eight neighbours."""
    padded = np.pad(loss, 1, constant_values=np.inf)
    around = np.stack(
        [np.roll(padded, (i, j), (0, 1))[1:-1, 1:-1] for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    )
    return [(int(i), int(j)) for i, j in np.argwhere(np.all(loss < around, axis=0))]


def _descend(model: ForwardModel, samples: Samples, start: NDArray) -> tuple[NDArray, float]:
    """A bounded least-squares descent by differences: where it ends, and e_f there."""
    parameters = model.parameters

    def residuals(theta: NDArray) -> NDArray:
        return model.predict(theta[None], samples.positions, samples.times)[0] - samples.values

    end = least_squares(
        residuals, start, bounds=(parameters.lower, parameters.upper), x_scale=parameters.half_width,
        diff_step=1e-4, xtol=1e-5, max_nfev=40,
    )  # fmt: skip  # pyright: ignore[reportArgumentType]
    return end.x, 2 * float(end.cost) / len(samples)


def _draw(axes: Axes, run: Found, found: xr.Dataset, n: int, episode: int, norm: LogNorm):
    """The map after n samples, its minima, the points solved in earlier episodes and in this one so far."""
    e_f, record = found["e_f"].sel(samples=n), run.record.isel(replicate=0)
    image = axes.pcolormesh(e_f.mu, e_f.omega, e_f.T, norm=norm, cmap=style.SEQUENTIAL, shading="nearest")
    image.set_rasterized(True)
    solved = record["trace_theta"].transpose("episode", "step", "solve", "parameter").values
    before, now = solved[:episode].reshape(-1, 2), solved[episode, :n].reshape(-1, 2)
    look: dict[str, Any] = {"linestyle": "", "zorder": 3}
    dots = look | {"markeredgecolor": "white", "markeredgewidth": 0.4}
    axes.plot(*before.T, "o", color=style.GREY, markersize=2.8, label="solved in earlier episodes", **dots)
    axes.plot(*now.T, "o", color=style.INK, markersize=3.6, label="solved in this one", **dots)
    theta, _ = minima(found, n)
    for edge, colours in ((2.6, ("white", "white")), (1.2, (style.BLUE, style.VERMILLION))):
        ring = look | {"markerfacecolor": "none", "markersize": 7, "markeredgewidth": edge, "zorder": 4}
        named = edge < 2
        axes.plot(*theta[1:].T, "o", color=colours[0], label="local minimum" if named else "", **ring)
        axes.plot(*theta[0], "o", color=colours[1], label="global minimum" if named else "", **ring)
    axes.plot(*record["true"].values, "+", color=style.VERMILLION, markersize=7, label="true", **look)
    style.label(axes, "$\\mu$ [1]")
    style.title(axes, f"after {n} samples")
    return image


def _numbers(found: xr.Dataset, counts: list[int]) -> dict[str, Any]:
    numbers: dict[str, Any] = {}
    for n in counts:
        theta, loss = minima(found, n)
        e_f = found["e_f"].sel(samples=n)
        numbers[f"{n} samples"] = {
            "minima": theta, "e_f": loss, "least": float(e_f.min()), "greatest": float(e_f.max()),
        }  # fmt: skip
    return numbers


def _caption(run: Found, episode: int, numbers: dict[str, Any]) -> str:
    counted = ", ".join(f"{len(found['minima'])} after {name}" for name, found in numbers.items())
    return (
        f"The misfit e_f over the bounds of (mu, omega) for the samples of episode {episode + 1} of "
        "replicate 0 (its best), with the minima that descents from the map end in, and the points that the "
        f"optimisation solved. Minima: {counted}."
    )


if __name__ == "__main__":
    experiments.command(make)
