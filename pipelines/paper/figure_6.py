"""Figure 6: paths under the double gyre in several episodes, with the line that separates the gyres.

python -m pipelines.paper.figure_6 [scale=small]

Takes seconds, and its run four minutes.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from fieldrl.figures import maps, style
from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import gyres


def plan(settings: Settings) -> dict[str, Wanted]:
    """The run of table 2."""
    return gyres.PLAN


def make(settings: Settings) -> None:
    """Find the run, draw four of replicate 0's episodes."""
    run = experiments.find(plan(settings), settings)[gyres.RUN]
    chosen = episodes(run)
    rows = -(-len(chosen) // 2)
    drawing = style.figure(style.PAGE, 0.5 + 1.55 * rows, layout="compressed")
    panels = drawing.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    level_sets = None
    for number, axes in enumerate(panels.flat):
        style.dress(axes)
        axes.set_visible(number < len(chosen))
        if number < len(chosen):
            level_sets = _draw(axes, run, *list(chosen.items())[number], number)
            lowest = number + 2 >= len(chosen)
            axes.tick_params(labelbottom=lowest)
            axes.set_xlabel(axes.get_xlabel() if lowest else "")
    for axes in panels[:, -1]:
        if level_sets is not None and axes.get_visible():
            style.colour_bar(level_sets, axes, maps.bar_label(run.record, maps.at_final_time(run.record)))
    style.legend_across(drawing, panels[0, 0])
    record = run.record
    numbers = {
        "episodes": {text: episode + 1 for episode, text in chosen.items()},
        "e_total": record["e_total"].isel(step=-1).values,
        "crosses": crosses(run),
        "positions": {str(e + 1): record["position"].values[0, e] for e in chosen},
    }
    artefacts.save(settings, "figure_6", drawing, _caption(), [run], numbers)


def episodes(run: Found) -> dict[int, str]:
    """Which episodes of replicate 0 are drawn, and why: first, best, worst and last, each once."""
    final = run.record["e_total"].isel(replicate=0, step=-1).values
    roles: dict[int, list[str]] = {}
    for episode, role in (
        (0, "first"),
        (int(run.record["best_episode"][0]), "least error"),
        (int(np.nanargmax(final)), "greatest error"),
        (len(final) - 1, "last"),
    ):
        roles.setdefault(episode, []).append(role)
    return {episode: ", ".join(names) for episode, names in sorted(roles.items())}


def crosses(run: Found) -> NDArray[np.bool_]:
    """Whether any sample was taken beyond the separation line of its moment, (replicates, episodes)."""
    line = gyres.line_of(run, run.record["time"].values)
    start_left = run.record["start"].values[0] < gyres.line_of(run, 0.0)
    left = run.record["position"].isel(axis=0).values < line
    return (left != start_left).any(axis=-1)


def _draw(axes: Axes, run: Found, episode: int, role: str, number: int):
    record = run.record
    maps.prepare(axes, record, first=number % 2 == 0)
    field = record["field_true"]
    level_sets = maps.draw_level_sets(axes, field, Normalize(*maps.value_range(field)))
    gyres.draw_separation(axes, run)
    positions = record["position"].isel(replicate=0, episode=episode).transpose("step", "axis")
    maps.draw_path(axes, record["start"].values, positions.values)
    error = float(record["e_total"].isel(replicate=0, episode=episode, step=-1))
    style.title(axes, f"Episode {episode + 1} ({role}), {style.E_TOTAL} = {error:.3g}")
    style.letter(axes, "ABCD"[number])
    return level_sets


def _caption() -> str:
    return (
        "Figure 6. Paths of replicate 0 in several of its episodes over the level sets of the true feature "
        "at the final time. Dashed: the line that separates the gyres at the final time; grey: where it "
        "swings during an episode."
    )


if __name__ == "__main__":
    experiments.command(make)
