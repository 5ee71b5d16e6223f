"""The diagnosis as pictures: what is learned by size of the signal, returns by episode, value functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fieldrl.figures import curves, files, style
from fieldrl.figures.learning import window
from pipelines import measures
from pipelines.diagnosis import returns
from pipelines.diagnosis.cases import CONTROLS, PAPER
from pipelines.diagnosis.measured import Measured
from pipelines.diagnosis.tables import late, signal
from pipelines.experiments import Settings
from pipelines.paper import evidence

_FROM = {"values from 0": "", "values from 200": ", from 200"}
_SIZES = (5, 20, 100)
_SHOWN = ("at every step", *PAPER)


def save(settings: Settings, name: str, picture: Figure, note: dict[str, Any]) -> None:
    """Write NAME.png and NAME.json."""
    settings.folder.mkdir(parents=True, exist_ok=True)
    files.save_noted(picture, settings.folder / f"{name}.png", {"name": name, **note})


def learning(found: Measured) -> Figure:
    """What is learned by size of the signal; returns of Eq. (19) by episode, with either estimator."""
    drawing = style.figure(style.PAGE, 2.6)
    panels = style.panels(drawing, 3)
    _learned(panels[0], found)
    for axes, estimator in zip(panels[1:], PAPER, strict=True):
        _returns(axes, found, estimator)
    for axes, letter in zip(panels, "ABC", strict=True):
        style.open_frame(axes)
        style.letter(axes, letter)
    panels[1].sharey(panels[2])
    return drawing


def values(found: Measured) -> Figure:
    """Greedy value functions at the end of learning: a row for each of two replicates."""
    drawing = style.figure(style.PAGE, 4.3, "compressed")
    rows = drawing.subplots(2, len(_SHOWN), sharex=True, sharey=True)
    for column, name in enumerate(_SHOWN):
        shown = found.parts[name, "learner"]["value"].values[:2]
        for axes, value in zip(rows[:, column], shown, strict=True):
            image = _map(axes, value, shown)
        style.title(
            rows[0, column], f"Eq. 19, {name}" if name in PAPER else "paid for nearness at every step"
        )
        style.common_colour_bar(drawing, image, rows[:, column], "greedy value")
    for axes in rows[:, 0]:
        style.label(axes, "", "$y$ [length]")
    for axes in rows[1]:
        style.label(axes, "$x$ [length]", axes.get_ylabel())
    return drawing


def _map(axes: Axes, value: NDArray, shown: NDArray) -> Any:
    style.dress(axes)
    low, high = np.nanmin(shown), np.nanmax(shown)
    extent = (0.0, 200.0, 0.0, 200.0)
    return axes.imshow(value.T, origin="lower", extent=extent, vmin=low, vmax=high, cmap=style.SEQUENTIAL)


def _learned(axes: Axes, found: Measured) -> None:
    """How much nearer to the feature than a random agent, over f; where Eq. (19) has its f."""
    random = found.parts["limited", "random"]["distance"].values
    for number, (label, ending) in enumerate(_FROM.items()):
        names = [f"at the end, noise, size {size}" for size in _SIZES]
        sizes = np.array([float(signal(CONTROLS[name].reward, random, found.noise)) for name in names])
        nearer = [
            late(random) - late(found.parts[name + ending, "learner"]["distance"].values) for name in names
        ]
        middle = np.median(nearer, axis=1)
        ends = np.abs(np.array([evidence.interval(each) for each in nearer]).T - middle)
        look: dict[str, Any] = {
            "color": style.SERIES[number],
            "linestyle": style.DASHES[number],
            "capsize": 2,
        }
        axes.errorbar(
            sizes * (1 + 0.06 * number), middle, ends, marker="o", markersize=3, lw=1, label=label, **look
        )
    for (estimator, agent), values in found.layouts.items():
        if agent == "random":
            effect = max(returns.parts(values).effect, 0.01)
            axes.axvline(effect, color=style.VERMILLION, lw=0.8, ls="--")
            axes.annotate(
                estimator,
                (effect, 1),
                (2, -2),
                ("data", "axes fraction"),
                "offset points",
                rotation=90,
                va="top",
                fontsize=6,
                color=style.VERMILLION,
            )
    axes.axhline(0, color=style.GREY, lw=0.6)
    axes.set_xscale("log")
    style.label(axes, "signal f (paths / noise)", "nearer than a random agent [length]")
    style.legend(axes, "upper left")


def _returns(axes: Axes, found: Measured, estimator: str) -> None:
    shown = {
        "values from 0": ("limited", "learner"),
        "values from 200": ("from 200", "learner"),
        "random agent": ("limited", "random"),
    }
    for number, (label, key) in enumerate(shown.items()):
        record = found.runs[estimator, *key].record
        returned = measures.final(record, "return")
        smooth = curves.rolling_mean(returned, window(returned.shape[1]))
        curves.draw_compared(axes, curves.episode_numbers(record), smooth, label, number)
    style.count_along_x(axes)
    style.label(axes, "Episode", "Return")
    style.title(axes, f"Eq. 19, {estimator}")
    style.legend(axes, "lower right")
