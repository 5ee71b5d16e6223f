"""What is known of an estimate: the field's standard deviation, joint regions, samples used."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fieldrl.figures import curves, estimates, maps, style

_LOOKS = {"best": (style.BLUE, "best episode", "s"), "pooled": (style.SERIES[2], "all samples", "o")}
_TRUTH: dict[str, Any] = {"marker": "x", "color": style.VERMILLION, "ms": 6.0, "mew": 1.3, "ls": "none"}


def field_std_figure(record: xr.Dataset, replicate: int = 0) -> Figure:
    """Standard deviation of the best episode's estimated field at the final time, with its samples.

    Args:
        record: a run's record with ``field_std``.
        replicate: its index.
    """
    std = record["field_std"].isel(replicate=replicate)
    drawing = style.figure(*maps.size(record, 1, beside=1.35, above=0.6), layout="compressed")
    (axes,) = style.panels(drawing, 1)
    maps.prepare(axes, record)
    image = maps.draw_field(axes, std, Normalize(0.0, maps.value_range(std, xr.zeros_like(std))[1]))
    best = int(record["best_episode"].isel(replicate=replicate))
    samples = record["position"].isel(replicate=replicate, episode=best).transpose("step", "axis")
    maps.draw_samples(axes, samples.values)
    style.colour_bar(image, axes, maps.bar_label(record, "Standard deviation"))
    rms = float(np.sqrt((std**2).mean()))
    episode = f"episode {curves.episode_numbers(record)[best]}"
    of = "all samples" if estimates.is_estimate(record) else episode
    style.title(axes, f"Estimate of {of}, rms {rms:.2g}")
    return drawing


def regions_figure(record: xr.Dataset, replicate: int = 0) -> Figure:
    """Joint regions of 50 and 95 % of every pair of unknowns, with all solutions, and the truth where known.

    At the left within the bounds, at the right as far as the regions reach.

    Args:
        record: a run's record with ``best_region_above``.
        replicate: its index.
    """
    one, pairs = record.isel(replicate=replicate), record.sizes["pair"]
    drawing = style.figure(style.PAGE, 3.1 * pairs)
    grid = drawing.subplots(pairs, 2, squeeze=False)
    for pair, row in enumerate(grid):
        first, second = (
            int(k) for k in record["best_region_pair"].isel(replicate=replicate, pair=pair).values
        )
        for axes, whole in zip(row, (True, False), strict=True):
            style.dress(axes)
            for estimate in _shown(record):
                _draw_regions(axes, one.isel(pair=pair), estimate, (first, second))
            axes.plot(*_truth(one)[[first, second]], **_TRUTH, zorder=9)
            _limits(axes, one.isel(pair=pair), (first, second), whole)
            names, units = (one[name].values for name in ("parameter", "parameter_unit"))
            style.label(axes, *(style.quantity(str(names[k]), str(units[k])) for k in (first, second)))
        style.title(row[0], "Within the bounds")
        style.title(row[1], "Closer")
    _legend(drawing, one, _shown(record))
    return drawing


def samples_used_figure(record: xr.Dataset) -> Figure:
    """Samples that each episode took until its intervals were narrow enough: each replicate, and the median.

    Args:
        record: a run's record with ``samples_used``.
    """
    used = record["samples_used"].transpose("replicate", "episode").values
    drawing = style.figure(style.PAGE, 2.3)
    (axes,) = style.panels(drawing, 1)
    style.open_frame(axes)
    numbers = curves.episode_numbers(record)
    axes.plot(numbers, used.T, ".", color=style.GREY, ms=2.5, alpha=0.5)
    axes.plot(numbers, np.median(used, axis=0), color=style.BLUE, lw=1.0, label="median of the replicates")
    axes.set_ylim(0, record.sizes["step"] + 1)
    style.count_along_x(axes)
    style.label(axes, "Episode", "Samples used")
    style.title(axes, f"Median {np.median(used):.0f} of {record.sizes['step']} samples")
    style.legend(axes)
    return drawing


def _shown(record: xr.Dataset) -> list[str]:
    """Which estimates: one of all samples alone where they are from a file."""
    return ["pooled"] if estimates.is_estimate(record) else list(_LOOKS)


def _truth(record: xr.Dataset) -> np.ndarray:
    """Of the best episode, (p,); NaN where nobody knows it."""
    if "truth" in record:
        return record["truth"].isel(episode=int(record["best_episode"])).values
    return record["true"].values


def _draw_regions(axes: Axes, record: xr.Dataset, estimate: str, pair: tuple[int, int]) -> None:
    colour, _, mark = _LOOKS[estimate]
    found = {name: record[f"{estimate}_region_{name}"] for name in ("first", "second", "above", "rise")}
    half, nearly_all = found["rise"].values
    for i in range(record.sizes["solution"]):
        above = found["above"].isel(solution=i).transpose("along_second", "along_first").values
        if not (np.isfinite(above).all() and np.isfinite(nearly_all)):
            continue
        where = (found["first"].isel(solution=i).values, found["second"].isel(solution=i).values, above)
        fills = [to_rgba(colour, 0.45), to_rgba(colour, 0.15)]
        axes.contourf(*where, levels=[-np.inf, half, nearly_all], colors=fills, zorder=2)
        axes.contour(*where, levels=[half, nearly_all], colors=[colour], linewidths=0.7, zorder=3)
    solutions = record[f"{estimate}_region_solutions"].transpose("solution", "parameter").values
    axes.plot(*solutions[:, pair].T, mark, color=colour, ms=3.4, mec="white", mew=0.5, zorder=6)


def _limits(axes: Axes, record: xr.Dataset, pair: tuple[int, int], whole: bool) -> None:
    """The bounds, or what the best episode's regions reach."""
    k = list(pair)
    low, high = record["lower"].values[k], record["upper"].values[k]
    if not whole:
        sides = [record[f"best_region_{name}"].values for name in ("first", "second")]
        if not all(np.isfinite(side).any() for side in sides):
            whole = True
        else:
            low, high = ([reach(side) for side in sides] for reach in (np.nanmin, np.nanmax))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def _legend(drawing: Figure, record: xr.Dataset, shown: list[str]) -> None:
    marks = [
        Line2D([], [], marker=mark, color=colour, ls="none", ms=4, label=f"{text}: 50 and 95 %")
        for colour, text, mark in (_LOOKS[name] for name in shown)
    ]
    if np.isfinite(_truth(record)).all():
        marks.append(Line2D([], [], label="truth", **_TRUTH))
    drawing.legend(
        handles=marks, loc="outside upper center", ncols=len(marks), frameon=False,
        fontsize=style.SMALL, labelcolor=style.INK,
    )  # fmt: skip
