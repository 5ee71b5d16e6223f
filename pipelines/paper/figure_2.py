"""Figure 2: how tile coding represents a state of two variables, drawn from our own tile coder.

python -m pipelines.paper.figure_2

Takes seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from fieldrl.agent.tile_coding import TileCoding
from fieldrl.figures import style
from pipelines import artefacts, experiments
from pipelines.experiments import Settings, Wanted

LOW, HIGH = np.zeros(4), np.array([200.0, 200.0, 1.0, 1.0])
STATE = np.array([88.0, 112.0, 0.0, 0.0])
_PIXELS = 200


@dataclass(frozen=True)
class Tiling:
    """Edges of a tiling's tiles along x and y [length], and its active tile (column, row)."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    active: tuple[int, int]


def plan(settings: Settings) -> dict[str, Wanted]:
    """No run is needed."""
    return {}


def make(settings: Settings) -> None:
    """Draw the paper's example, and the coding of the experiments."""
    example, used = TileCoding(tilings=3, tiles=(2, 2)), TileCoding()
    drawing = style.figure(style.PAGE, 2.5)
    left, middle, right = drawing.subplots(1, 3, width_ratios=(1, 0.75, 1.1))
    _draw_tilings(left, tilings(example))
    features = feature_vector(example)
    _draw_features(middle, features, example)
    shared = shared_tiles(used)
    image = right.imshow(shared.T, origin="lower", extent=(0, 200, 0, 200), cmap=style.SEQUENTIAL)
    right.plot(*STATE[:2], "o", color=style.VERMILLION, markersize=4, markeredgecolor="white")
    style.dress(right)
    style.label(right, "$x$ [length]", "$y$ [length]")
    style.colour_bar(image, right, "Tiles shared with the state")
    for axes, letter in ((left, "A"), (middle, "B"), (right, "C")):
        style.letter(axes, letter)
    numbers = {"features": features, "shared tiles": shared[::20, ::20]}
    artefacts.save(settings, "figure_2", drawing, _caption(), (), numbers)


def tilings(coding: TileCoding) -> list[Tiling]:
    """The tiles of every tiling over the first two observed variables."""
    coder, shape = coding.coder(LOW, HIGH), coding.tiles
    active = coding.active(STATE, coder)
    found = []
    for number, feature in enumerate(active):
        edges = [row[1] + (np.arange(row[3] + 1) - row[4 + number]) / row[2] for row in coder]
        column, row = np.unravel_index(feature - number * np.prod(shape), shape)  # type: ignore[arg-type]
        found.append(Tiling(edges[0], edges[1], (int(column), int(row))))
    return found


def feature_vector(coding: TileCoding) -> NDArray[np.int64]:
    """x(s) of the state: one for each active tile, (features,)."""
    features = np.zeros(coding.features, dtype=np.int64)
    features[coding.active(STATE, coding.coder(LOW, HIGH))] = 1
    return features


def shared_tiles(coding: TileCoding) -> NDArray[np.int64]:
    """How many active tiles each place has in common with the state: how learning generalises, (x, y)."""
    coder, here = coding.coder(LOW, HIGH), coding.active(STATE, coding.coder(LOW, HIGH))
    places = (np.arange(_PIXELS) + 0.5) * HIGH[0] / _PIXELS
    count = [
        [np.sum(coding.active(np.array([x, y, 0.0, 0.0]), coder) == here) for y in places] for x in places
    ]
    return np.array(count)


def _draw_tilings(axes: Axes, found: list[Tiling]) -> None:
    """Inactive tiles dashed, active ones solid, the state a point."""
    for number, tiling in enumerate(found):
        colour = style.SERIES[number]
        look = {"color": colour, "linewidth": 0.7, "linestyle": (0, (3, 2))}
        axes.vlines(tiling.x, tiling.y[0], tiling.y[-1], **look)
        axes.hlines(tiling.y, tiling.x[0], tiling.x[-1], **look)
        (i, j), width, height = tiling.active, np.diff(tiling.x), np.diff(tiling.y)
        corner = float(tiling.x[i]), float(tiling.y[j])
        axes.add_patch(Rectangle(corner, width[i], height[j], fill=False, edgecolor=colour, linewidth=1.8))
    axes.add_patch(Rectangle((0, 0), 200, 200, facecolor=style.PALE, alpha=0.5, zorder=0))
    axes.plot(*STATE[:2], "o", color=style.INK, markersize=4, zorder=5)
    axes.set(aspect="equal", xticks=(0, 100, 200), yticks=(0, 100, 200))
    style.dress(axes)
    style.open_frame(axes)
    style.label(axes, "$x$ [length]", "$y$ [length]")


def _draw_features(axes: Axes, features: NDArray[np.int64], coding: TileCoding) -> None:
    """The feature vector as a column of boxes, a colour for each tiling."""
    each = coding.features // coding.tilings
    for number, value in enumerate(features):
        colour = style.SERIES[number // each]
        column, row = divmod(number, each)
        face = colour if value else "white"
        axes.add_patch(Rectangle((column, -row), 0.9, 0.9, facecolor=face, edgecolor=colour, linewidth=1.0))
        ink = "white" if value else style.INK
        text = f"$x_{{{number}}}$ = {value}"
        axes.text(column + 0.45, -row + 0.45, text, ha="center", va="center", fontsize=style.SMALL, color=ink)
    axes.set(xlim=(-0.1, coding.tilings), ylim=(1 - each - 0.1, 1), xticks=(), yticks=())
    axes.spines[:].set_visible(False)
    for number in range(coding.tilings):
        axes.text(
            number + 0.45, 1.1, f"tiling {number + 1}", ha="center", fontsize=style.SMALL, color=style.INK
        )


def _caption() -> str:
    return (
        "Figure 2. Tile coding of a state (x, y), drawn from the package's tile coder. A: three tilings of "
        "2 x 2 tiles over the domain (grey); the active tile of each is solid, the others are dashed. B: "
        "the feature vector, one component of each tiling is 1. C: the coding of the experiments, 8 tilings "
        "of 8 x 8 tiles: how many of its 8 active tiles a place shares with the marked state, which is how "
        "far learning generalises."
    )


if __name__ == "__main__":
    experiments.command(make)
