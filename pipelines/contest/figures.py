"""Pictures of the contest's table."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fieldrl.core.streams import stream
from fieldrl.figures import style
from pipelines.contest.statistics import bootstrap, interquartile_mean, performance_profile

_THRESHOLDS = np.geomspace(0.1, 1e3, 200)
_SKY = "#56B4E9"
_LOOKS = {
    "random": (style.GREY, style.DASHES[1]),
    "lawnmower": (style.SERIES[1], style.DASHES[2]),
    "greedy_information": (style.SERIES[2], style.DASHES[1]),
    "informed_sarsa_lambda": (style.BLUE, style.DASHES[0]),
    "planner": (style.SERIES[3], style.DASHES[3]),
    "oracle": (style.INK, style.DASHES[2]),
    "drift": (style.GREY, style.DASHES[2]),
    "gradient": (style.VERMILLION, style.DASHES[1]),
    "sarsa_lambda": (_SKY, style.DASHES[0]),
    "true_online_sarsa_lambda": (_SKY, style.DASHES[1]),
}
_COMPARED = tuple(_LOOKS)[:6]
"""Sample by sample; ten curves with their bands would be too many."""


def profiles(errors: Mapping[str, NDArray[np.float64]]) -> Figure:
    """The share of missions whose error is at most a value, by agent.

    Args:
        errors: parameter errors of each agent, (places, seeds) [that of the oracle at the place].
    """
    drawing = style.figure(style.PAGE, 3.4)
    axes = drawing.subplots()
    style.dress(axes)
    for agent, scores in errors.items():
        colour, dashes = _LOOKS[agent]
        shares = performance_profile(scores, _THRESHOLDS)
        axes.plot(_THRESHOLDS, shares, color=colour, linestyle=dashes, linewidth=1.2, label=agent)
    axes.set_xscale("log")
    style.label(axes, "Error of the flow / the oracle's", "Share of missions")
    style.legend_across(drawing, axes)
    return drawing


def by_sample(places: Mapping[str, Mapping[str, NDArray[np.float64]]]) -> Figure:
    """The error after each sample, by agent: interquartile mean over missions, and its 95 % interval.

    Args:
        places: for each place by its name, each agent's errors, (seeds, samples) [length/time; half-widths
            of the bounds where units differ].
    """
    rows = -(-len(places) // 2)
    drawing = style.figure(style.PAGE, 0.4 + 2.2 * rows)
    grid = drawing.subplots(rows, min(2, len(places)), squeeze=False, sharey=True)
    for axes, (place, agents) in zip(grid.flat, places.items(), strict=False):
        style.dress(axes)
        style.open_frame(axes)
        style.count_along_x(axes)
        style.title(axes, place)
        for agent in (name for name in _COMPARED if name in agents):
            _draw_by_sample(axes, agent, agents[agent])
        style.logarithmic(axes, 3.0)
        style.label(axes, "Sample", "Error of the unknowns" if axes in grid[:, 0] else "")
    for axes in grid.flat[len(places) :]:
        axes.set_visible(False)
    style.legend_across(drawing, grid[0, 0])
    return drawing


def _draw_by_sample(axes: Axes, agent: str, errors: NDArray[np.float64]) -> None:
    colour, dashes = _LOOKS[agent]
    samples = np.arange(1, errors.shape[1] + 1)
    rng = stream(0, "contest bootstrap")
    bands = [bootstrap(column[None], rng, 500) for column in errors.T]
    middle = [interquartile_mean(column) for column in errors.T]
    axes.plot(samples, middle, color=colour, linestyle=dashes, linewidth=1.2, label=agent)
    axes.fill_between(samples, *np.transpose(bands), color=colour, alpha=0.15, linewidth=0)
