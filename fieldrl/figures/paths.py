"""Paths of the vehicle over the level sets of the true field at the final time, after figure 4."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure

from fieldrl.figures import curves, maps, style


def path_figure(record: xr.Dataset, replicate: int = 0) -> Figure:
    """Paths of the first, the best and the last episode of a replicate, one panel for each that differs.

    Args:
        record: a run's record.
        replicate: its index.
    """
    episodes = notable_episodes(record, replicate)
    drawing = style.figure(*maps.size(record, len(episodes), beside=1.35, above=0.75), layout="compressed")
    row = style.panels(drawing, len(episodes), shared=True)
    for axes, (episode, role) in zip(row, episodes.items(), strict=True):
        maps.prepare(axes, record, first=axes is row[0])
        level_sets = draw_episode(axes, record, episode, replicate)
        style.title(axes, f"{role}\n{_score(record, episode, replicate)}")
    style.legend_above(drawing, row[0])
    if level_sets is not None:
        text = maps.bar_label(record, maps.at_final_time(record))
        style.colour_bar(level_sets, row[-1], text)
    return drawing


def best_path_figure(record: xr.Dataset, replicate: int = 0) -> Figure:
    """The path of the best episode of a replicate over the field at the final time, the true one if known."""
    drawing = style.figure(*maps.size(record, 1, beside=1.35, above=0.6), layout="compressed")
    (axes,) = style.panels(drawing, 1)
    maps.prepare(axes, record)
    episode = int(record["best_episode"].isel(replicate=replicate))
    draw_episode(axes, record, episode, replicate)
    style.title(
        axes, f"Episode {curves.episode_numbers(record)[episode]}, {_score(record, episode, replicate)}"
    )
    return drawing


def draw_episode(axes: Axes, record: xr.Dataset, episode: int, replicate: int) -> QuadContourSet | None:
    """One episode's path over the level sets of the true field; returns the level sets, or None."""
    field = maps.true_field(record, replicate)
    level_sets = maps.draw_level_sets(axes, field, Normalize(*maps.value_range(field)))
    positions = record["position"].isel(replicate=replicate, episode=episode).transpose("step", "axis")
    maps.draw_path(axes, record["start"].values, positions.values)
    return level_sets


def notable_episodes(record: xr.Dataset, replicate: int = 0) -> dict[int, str]:
    """Index and title of the first, the best and the last episode, in order of time; equal ones are one.

    Where every episode has a truth of its own, the record holds the true field of the best one alone.
    """
    best = int(record["best_episode"].isel(replicate=replicate))
    if "truth" in record:
        return {best: f"Episode {curves.episode_numbers(record)[best]} (best)"}
    roles: dict[int, list[str]] = {}
    for episode, role in ((0, "first"), (best, "best"), (record.sizes["episode"] - 1, "last")):
        roles.setdefault(episode, []).append(role)
    numbers = curves.episode_numbers(record)
    return {episode: f"Episode {numbers[episode]} ({', '.join(names)})" for episode, names in roles.items()}


def _score(record: xr.Dataset, episode: int, replicate: int) -> str:
    """The episode's total error, Eq. 7, after its last sample."""
    error = float(record["e_total"].isel(replicate=replicate, episode=episode, step=-1))
    return f"{style.E_TOTAL} = {error:.3g}" if np.isfinite(error) else f"{style.E_TOTAL} unknown"
