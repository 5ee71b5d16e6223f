"""The calibration as a picture: ranks of the truths, coverage by samples, power by size of the misfit."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldrl.figures import style
from pipelines.calibration import evidence
from pipelines.calibration.missions import AGENTS, SIZES
from pipelines.calibration.needed import WIDTHS
from pipelines.calibration.tables import Judged, experiments, of
from pipelines.calibration.wrong import WRONG

_KOLMOGOROV = 1.358  # 95 % of the largest deviation of an empirical distribution, times the root of N
_TITLES = {"advection": "Advection", "double_gyre": "Double gyre"}


def draw(judged: Judged) -> Figure:
    """A panel of ranks for each experiment, coverage, power."""
    there = experiments(judged)
    drawing = style.figure(style.PAGE, 2.7 * (1 + (len(there) > 1)))
    axes = drawing.subplots(2, 2).ravel() if len(there) > 1 else style.panels(drawing, 3)
    for one, letter in zip(axes, "abcd", strict=False):
        style.dress(one)
        style.open_frame(one)
        style.letter(one, letter)
    for one, experiment in zip(axes, there, strict=False):
        _ranks(one, judged, experiment)
    _coverage(axes[-2], judged)
    _power(axes[-1], judged)
    style.legend_across(drawing, axes[-2])
    return drawing


def _ranks(axes: Axes, judged: Judged, experiment: str) -> None:
    """How far the distribution of the ranks lies above the uniform one."""
    fewest = min(len(_telling(judged, experiment, n)) or 10**9 for n in SIZES)
    band = _KOLMOGOROV / np.sqrt(fewest)
    axes.axhspan(-band, band, color=style.PALE, alpha=0.6, lw=0)
    for n, colour, dash in zip(SIZES, style.SERIES, style.DASHES, strict=True):
        rows = _telling(judged, experiment, n)
        if not rows:
            continue
        for k, ranks in enumerate(evidence.ranks(rows)):
            above = np.arange(1, len(ranks) + 1) / len(ranks) - ranks
            axes.plot(ranks, above, color=colour, ls=dash, lw=0.9, label=f"n = {n}" if k == 0 else None)
    axes.set_xlim(0, 1)
    style.label(axes, "rank of the truth", "distribution - uniform")
    style.title(axes, f"{_TITLES[experiment]}, informative")
    style.legend(axes)


def _telling(judged: Judged, experiment: str, n: int) -> evidence.Rows:
    return evidence.informative(evidence.of_size(of(judged, experiment), n))


def _coverage(axes: Axes, judged: Judged) -> None:
    """Of the intervals at every level, by samples; each agent a point."""
    looks = zip(WRONG, (style.SERIES[0], style.SERIES[1]), (-0.06, 0.06), strict=True)
    for experiment, colour, aside in looks:
        for agent, mark in zip(AGENTS, "o^s", strict=True):
            rows = judged.get((experiment, agent), [])
            if not rows:
                continue
            for i in range(3):
                shares = [evidence.coverage(evidence.of_size(rows, n), "covered")[i] for n in SIZES]
                x = np.arange(len(SIZES)) + aside
                label = f"{_TITLES[experiment]}, {agent}" if i == 0 else None
                means = [each.mean for each in shares]
                axes.plot(x, means, mark, color=colour, ms=3.2, mfc="none", mew=0.8, label=label)
                if agent == AGENTS[0]:  # of one agent's missions
                    axes.vlines(
                        x,
                        [each.low for each in shares],
                        [each.high for each in shares],
                        color=colour,
                        lw=3.5,
                        alpha=0.25,
                    )
    for level in evidence.LEVELS:
        axes.axhline(level, color=style.VERMILLION, lw=0.7)
    axes.set_xticks(np.arange(len(SIZES)), [str(n) for n in SIZES])
    axes.set_ylim(0.35, 1.01)
    style.label(axes, "samples of a mission", "coverage")
    style.title(axes, "Intervals of 50, 80, 95 %")


def draw_needed(judged: Judged) -> Figure:
    """Share of the missions whose intervals are all narrow enough, by samples; a panel for each agent."""
    drawing = style.figure(style.PAGE, 2.2)
    row = style.panels(drawing, len(AGENTS), shared=True)
    for axes, agent in zip(row, AGENTS, strict=True):
        style.open_frame(axes)
        rows = judged.get(("advection", f"needed {agent}"), ())
        for width, colour, dash in zip(WIDTHS if rows else (), style.SERIES, style.DASHES, strict=False):
            narrow = np.array([row["widest"] for row in rows]) < width
            share = np.maximum.accumulate(narrow, axis=1).mean(axis=0)
            n = np.arange(1, len(share) + 1)
            axes.step(n, share, where="mid", color=colour, ls=dash, lw=1.0, label=f"width {width:g}")
        axes.set_ylim(0, 1.02)
        style.count_along_x(axes)
        style.label(axes, "samples", "intervals narrow enough" if axes is row[0] else "")
        style.title(axes, agent.capitalize())
    style.legend_across(drawing, row[0])
    return drawing


def _power(axes: Axes, judged: Judged) -> None:
    """Wrong models that are called wrong."""
    each = [(experiment, name) for experiment in experiments(judged) for name in WRONG[experiment]]
    for (experiment, name), colour, dash in zip(each, style.SERIES, style.DASHES, strict=False):
        _, size, told = np.array(evidence.power_by_size(of(judged, experiment), name)).T
        label = f"{_TITLES[experiment]}, {name}"
        axes.plot(size, told, color=colour, ls=dash, lw=1.0, marker="o", ms=2.5, label=label)
    axes.axhline(0.05, color=style.VERMILLION, lw=0.7)
    axes.axhline(0.9, color=style.GREY, lw=0.5, ls=":")
    axes.set_ylim(0, 1.02)
    style.label(axes, "misfit, rms [std of the noise]", "called wrong")
    style.title(axes, f"Wrong models, n = {SIZES[-1]}")
    style.legend(axes, "center right")
