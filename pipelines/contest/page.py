"""The page of the contest, from its table alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from numpy.typing import NDArray

from fieldrl.core.streams import stream
from pipelines.contest import figures
from pipelines.contest.statistics import (
    bootstrap,
    bootstrap_ratio,
    interquartile_mean,
    probability_of_improvement,
)

PLACE = ["experiment", "start", "plume"]
_ERRORS = ("parameter_error", "field_error")


def write(table: Any, folder: Path, episodes: int, small: bool) -> None:
    """Leave index.html, profiles.png and by_sample.png.

    Args:
        table: a DataFrame of all missions, see ``missions.missions``.
        folder: where.
        episodes: that learners trained.
        small: the scale.
    """
    parts, all_places = by_place(table), relative(table)
    figures.profiles(scores(all_places, "parameter_error")).savefig(folder / "profiles.png", dpi=160)
    courses = {name: course(part) for name, part in parts}
    figures.by_sample(courses).savefig(folder / "by_sample.png", dpi=200)
    loader = FileSystemLoader(Path(__file__).parent)
    page = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    text = page.get_template("page.html.jinja").render(
        together=summary(all_places),
        places=[(name, summary(part)) for name, part in parts],
        seeds=[rows["seed"].nunique() for _, rows in parts],
        steps=20,
        episodes=episodes,
        small=small,
    )
    (folder / "index.html").write_text(text, encoding="utf-8")


def by_place(table: Any) -> list[tuple[str, Any]]:
    """Each place by its name, with its missions."""
    groups = table.groupby(PLACE, sort=False)
    return [(f"{name}, start {start}, plume {plume}", rows) for (name, start, plume), rows in groups]


def relative(table: Any) -> Any:
    """The same with errors as multiples of the oracle's at each place, so that places can be put together: as
    many missions of each as the place with the fewest has, the first ones."""
    parts, count = [], table.groupby(PLACE)["seed"].nunique().min()
    for _, rows in table.groupby(PLACE, sort=False):
        first = rows[rows["seed"] < count]
        oracle = first[first["agent"] == "oracle"]
        scale = {name: interquartile_mean(oracle[name].to_numpy(float)) for name in _ERRORS}
        parts.append(first.assign(**{name: first[name] / scale[name] for name in _ERRORS}))
    return pd.concat(parts)


def scores(table: Any, column: str) -> dict[str, NDArray[np.float64]]:
    """A column by agent, (places, seeds) each."""
    return {
        str(agent): np.stack([part[column].to_numpy(float) for _, part in rows.groupby(PLACE, sort=False)])
        for agent, rows in table.groupby("agent", sort=False)
    }


def course(table: Any) -> dict[str, NDArray[np.float64]]:
    """The error after each sample by agent, at one place, (seeds, samples) each."""
    columns = [name for name in table if name.startswith("error_")]
    columns = [name for name in columns if table[name].notna().all()]
    return {str(agent): rows[columns].to_numpy(float) for agent, rows in table.groupby("agent", sort=False)}


def summary(table: Any) -> list[list[str]]:
    """A row for each agent, the best first: what the page's table holds."""
    errors, fields = scores(table, "parameter_error"), scores(table, "field_error")
    means = table.groupby("agent")[["identified", "seconds", "training_seconds"]].mean()
    totals = table.groupby("agent")["e_total"].median()
    rng, rows = stream(0, "contest bootstrap"), []
    for agent in sorted(errors, key=lambda name: interquartile_mean(errors[name])):
        low, high = bootstrap(errors[agent], rng)
        times = times_the_oracle(errors, agent, rng)
        beats = probability_of_improvement(errors[agent], errors["random"]) if "random" in errors else np.nan
        mean = means.loc[agent]
        cost = f"{mean['seconds']:.2g}", f"{mean['training_seconds']:.0f}"
        rows.append([
            agent, f"{interquartile_mean(errors[agent]):.3g} [{low:.3g}, {high:.3g}]", times,
            f"{interquartile_mean(fields[agent]):.3g}", f"{100 * mean['identified']:.0f} %",
            f"{totals[agent]:.3g}", *cost, f"{beats:.2f}",
        ])  # fmt: skip
    return rows


def times_the_oracle(errors: dict[str, NDArray[np.float64]], agent: str, rng: np.random.Generator) -> str:
    """The interquartile mean in that of the oracle's, and its 95 % interval, mission by mission."""
    if agent == "oracle" or "oracle" not in errors:
        return ""
    own, others = errors[agent], errors["oracle"]
    value = interquartile_mean(own) / interquartile_mean(others)
    low, high = bootstrap_ratio(own, others, rng)
    return f"{value:.3g} [{low:.3g}, {high:.3g}]"
