"""Table 1: the actions of the vehicle, and how far each takes it within one step in still water.

python -m pipelines.paper.table_1

Takes seconds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fieldrl.core.domain import Domain
from fieldrl.figures import style
from fieldrl.pde.flow import UniformFlow
from fieldrl.vehicle.unicycle import Unicycle
from pipelines import artefacts, experiments
from pipelines.experiments import Settings, Wanted

_PARTS = 20  # points of a drawn path


def plan(settings: Settings) -> dict[str, Wanted]:
    """No run is needed."""
    return {}


def make(settings: Settings) -> None:
    """The table in the JSON, its picture beside it."""
    vehicle = Unicycle()
    paths = {name: path(vehicle, number) for number, name in enumerate(vehicle.action_names)}
    drawing = style.figure(style.PAGE, 2.2)
    left, right = drawing.subplots(1, 2, width_ratios=(1, 1.5))
    _draw_paths(left, paths)
    _draw_table(right, rows(vehicle))
    numbers = {"rows": rows(vehicle), "ends": {name: found[-1] for name, found in paths.items()}}
    artefacts.save(settings, "table_1", drawing, _caption(vehicle), (), numbers)


def rows(vehicle: Unicycle) -> list[list[str]]:
    """Speed, turn and what it means, for each action of Eq. (12)."""
    top = vehicle.max_speed
    return [
        [_speed(speed / top), _turn(turn), name]
        for (speed, turn), name in zip(vehicle.actions, vehicle.action_names, strict=True)
    ]


def path(vehicle: Unicycle, action: int) -> NDArray[np.float64]:
    """Places (k, 2) within one step of an action in still water, relative to its start [length]."""
    water = Domain((-100.0, -100.0), (100.0, 100.0))
    found = [np.zeros(2)]
    for share in np.linspace(0, 1, _PARTS + 1)[1:]:
        part = Unicycle(
            (0.0, 0.0), 0.0, vehicle.max_speed, vehicle.turn * share, time_step=vehicle.time_step * share
        )
        end = part.step(part.initial(), action, 0.0, UniformFlow(), np.zeros(2), water)
        found.append(end[:2])
    return np.array(found)


def _speed(share: float) -> str:
    return {0.0: "0", 0.5: "v_max / 2", 1.0: "v_max"}[round(float(share), 6)]


def _turn(turn: float) -> str:
    return "0" if turn == 0 else "+phi" if turn > 0 else "-phi"


def _draw_paths(axes: Axes, paths: dict[str, NDArray[np.float64]]) -> None:
    for number, found in enumerate(paths.values(), 1):
        axes.plot(*found.T, color=style.INK, linewidth=1.0)
        axes.plot(*found[-1], "o", color=style.INK, markersize=2.5)
        moves = bool(np.ptp(found))
        look: dict[str, Any] = {
            "fontsize": style.SMALL,
            "color": style.INK,
            "ha": "left" if moves else "right",
        }
        axes.annotate(str(number), found[-1], (4 if moves else -4, 3), textcoords="offset points", **look)
    axes.plot(0, 0, "D", color=style.VERMILLION, markersize=4, zorder=5)
    axes.set(aspect="equal", xlim=(-1.5, 11.5), ylim=(-3, 3))
    style.dress(axes)
    style.open_frame(axes)
    style.label(axes, "ahead [length]", "to the left [length]")


def _draw_table(axes: Axes, lines: list[list[str]]) -> None:
    axes.axis("off")
    cells = [[str(number), *_typeset(line)] for number, line in enumerate(lines, 1)]
    table = axes.table(
        cells, colLabels=["", "speed", "turn", "meaning"], colWidths=[0.06, 0.18, 0.12, 0.64], loc="center",
        cellLoc="left", edges="horizontal",
    )  # fmt: skip
    table.auto_set_font_size(False)
    table.set_fontsize(style.TEXT)
    table.scale(1.0, 1.05)
    for cell in table.get_celld().values():
        cell.set_linewidth(0.4)


def _typeset(line: list[str]) -> list[str]:
    symbols = {"v_max": "$v_{max}$", "v_max / 2": "$v_{max}/2$", "+phi": "$+\\phi$", "-phi": "$-\\phi$"}
    return [symbols.get(cell, cell) for cell in line]


def _caption(vehicle: Unicycle) -> str:
    return (
        "Table 1. The seven actions of Eq. 12 and where each ends after one step in still water, from "
        f"heading 0. v_max = {vehicle.max_speed:g} length/time, phi = {vehicle.turn:.4g} rad, step "
        f"{vehicle.time_step:g} time. The paper's table 1 leaves out the seventh and swaps the signs of phi "
        "at half speed; here +phi turns counter-clockwise at every speed."
    )


if __name__ == "__main__":
    experiments.command(make)
