"""Figure 3: total error and return of every episode, while step size, trace decay and epsilon are varied.

python -m pipelines.paper.figure_3 [scale=small]

Drawn twice, on the same scales: with one start for each fit, and with every fit at its global minimum.

Takes seconds, and its runs a quarter of an hour.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fieldrl.figures import curves, style
from fieldrl.figures.learning import draw_expectation, window
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import variations

_QUANTITIES = {"e_total": f"Total error {style.E_TOTAL} [(field unit)$^{{2}}$]", "return": "Return"}


def plan(settings: Settings) -> dict[str, Wanted]:
    """The runs of figure 3."""
    return variations.plan(settings)


def make(settings: Settings) -> None:
    """Find the runs, draw both figures."""
    runs = experiments.find(plan(settings), settings)
    limits = {quantity: _limits(runs, quantity) for quantity in _QUANTITIES}
    for estimator in variations.ESTIMATORS:
        _make_one(settings, estimator, runs, limits)


def series(record: xr.Dataset, quantity: str) -> NDArray[np.float64]:
    """Rolling mean over episodes of e_total (after the last sample) or return, (replicates, episodes)."""
    values = record["e_total"].isel(step=-1) if quantity == "e_total" else record["return"]
    values = values.transpose("replicate", "episode").values
    return curves.rolling_mean(values, window(values.shape[1]))


def _make_one(settings: Settings, estimator: str, runs: dict[str, Found], limits: dict) -> None:
    drawing = style.figure(style.PAGE, 4.3)
    panels = drawing.subplots(2, 3, sharex=True, sharey="row")
    numbers: dict[str, Any] = {}
    for column, parameter in enumerate(variations.PARAMETERS):
        for row, quantity in enumerate(_QUANTITIES):
            axes: Axes = panels[row, column]
            style.letter(axes, "ABCDEF"[2 * column + row])
            numbers[f"{quantity} {parameter}"] = _draw(axes, settings, estimator, parameter, quantity, runs)
            axes.set_ylim(*limits[quantity])
            style.label(axes, "Episode" if row else "", "" if column else _QUANTITIES[quantity])
        style.legend(panels[1, column], "lower right")
    used = [runs[name] for name in variations.plan(settings, estimator)]
    caption = _caption(used[0].record, estimator)
    artefacts.save(settings, f"figure_3_{estimator}", drawing, caption, used, numbers, "figure_3")


def _draw(axes: Axes, settings: Settings, estimator: str, parameter: str, quantity: str, runs: dict) -> dict:
    """One panel; returns the quartiles of each value's series."""
    style.dress(axes)
    drawn = {}
    for number, value in enumerate(variations.values(parameter, settings)):
        record = runs[variations.name(estimator, parameter, value)].record
        episodes = curves.episode_numbers(record)
        label = f"{variations.PARAMETERS[parameter].symbol} = {value:g}"
        found = curves.draw_compared(axes, episodes, series(record, quantity), label, number)
        drawn[f"{value:g}"] = dict(zip(("lower", "median", "upper"), found, strict=True))
    if quantity == "e_total":
        style.logarithmic(axes, 1.0)
        draw_expectation(axes, float(record.attrs["noise"]))
    style.open_frame(axes)
    style.count_along_x(axes)
    return drawn


def _limits(runs: dict[str, Found], quantity: str) -> tuple[float, float]:
    """Of the axis that all panels share: every quartile of every run fits in."""
    bands = np.concatenate([curves.quartiles(series(run.record, quantity)).ravel() for run in runs.values()])
    low, high = float(np.nanmin(bands)), float(np.nanmax(bands))
    return (0.9 * low, 1.1 * high) if quantity == "e_total" else (low - 0.05 * (high - low), 1.05 * high)


def _caption(record: xr.Dataset, estimator: str) -> str:
    replicates, episodes, steps = (record.sizes[name] for name in ("replicate", "episode", "step"))
    return (
        f"Figure 3, {variations.ESTIMATORS[estimator].title}. Total error after the last sample (A, C, E) "
        "and return (B, D, F) of every episode while the step size, the trace decay and epsilon are varied; "
        "what is not varied is 0.9, 0.9 and 0.15. Line and band: median and interquartile range over "
        f"{replicates} replicates of {episodes} episodes of {steps} samples, each smoothed by a rolling mean "
        f"of {window(episodes)} episodes. Dashed: what is expected from the noise alone. Waves that "
        "all curves share are the noise of the samples, which is the same in all runs."
    )


if __name__ == "__main__":
    experiments.command(make)
