"""Figure 3's trends at settings that the paper leaves unsaid, judged beside agents that act at random.

    python -m pipelines.paper.figure_3_settings [scale=small] [output_dir=FOLDER] [jobs=N]

The settings of ``figure_3_space.NAMED``: one start for each fit, values that begin at 200 or at 0. Twelve
replicates of each variation, paired by their noise, with a seed that no search has seen; every comparison is
judged as the paper's claims are, corrected for all of them. "By chance": trends that seem to hold with agents
that act at random, six replicates, each variation with noise of its own.

Takes five minutes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.agent.random import Random
from fieldrl.agent.sarsa_lambda import LearningDiverged
from fieldrl.cli.compose import composed
from fieldrl.mission.learning import Replicate
from fieldrl.runs.components import mission
from fieldrl.sweeps.space import Point
from pipelines import artefacts, experiments, report
from pipelines.experiments import SCALES, Settings
from pipelines.paper import rules
from pipelines.paper.figure_3_space import NAMED, described, named, overrides
from pipelines.paper.figure_3_trends import TRENDS, VARIATIONS, Comparison, Curves, score, seeming, trends
from pipelines.paper.page import MARKS
from pipelines.paper.rules import Outcome

REPLICATES = {"paper": {"learner": 12, "random": 6}, "small": {"learner": 2, "random": 2}}
SEED = 1
"""Of the judgement."""

COLUMNS = ("", "score", *TRENDS, "hold", "by chance")
"""Of the table of what was judged."""

_MARKS = {Outcome.YES: "yes", Outcome.NO: "no", Outcome.OPEN: "open"}
_CHANCE = 1000  # first seed of random agents, ten apart for each variation
_VERSION = 1  # of what is kept


class Task(NamedTuple):
    """A point that is run in all variations.

    Args:
        point: of the space.
        agent: "learner", or "random" for agents that act at random.
        seed: of its streams.
        replicates: of each variation.
    """

    point: Point
    agent: str
    seed: int
    replicates: int


class Judged(NamedTuple):
    """A point as it was judged.

    Args:
        name: what it is.
        point: of the space.
        score: of its trends.
        outcomes: of each trend.
        measured: of each trend, its comparisons as text.
        chance: which trends seem to hold with agents that act at random.
    """

    name: str
    point: Point
    score: float
    outcomes: dict[str, Outcome]
    measured: dict[str, list[str]]
    chance: dict[str, bool]


def make(settings: Settings) -> list[Judged]:
    """Run what is missing, judge, print, write; returns what was judged."""
    judged = judge({name: named(each) for name, each in NAMED.items()}, settings)
    show(judged)
    artefacts.put(settings, "figure_3_settings.md", detailed(judged).encode())
    numbers = {"judged": [plain(each) for each in judged]}
    caption = "Figure 3's trends at settings that the paper leaves unsaid."
    artefacts.note(settings, "figure_3_settings", {"caption": caption}, [], numbers)
    return judged


def judge(points: Mapping[str, Point], settings: Settings) -> list[Judged]:
    """Points by name, with noise that none was chosen by; every comparison is corrected for all of them."""
    counts = REPLICATES[settings.scale]
    tasks = {(n, a): Task(point, a, SEED, counts[a]) for n, point in points.items() for a in counts}
    curves = run(tasks, settings)
    rests = {name: trends(curves[name, "learner"]) for name in points if (name, "learner") in curves}
    outcomes = _outcomes(rests)
    return [
        Judged(
            name,
            points[name],
            score(curves[name, "learner"]),
            {trend: together([each.outcome for each in outcomes[name, trend]]) for trend in one},
            {trend: [_text(each) for each in outcomes[name, trend]] for trend in one},
            seeming(curves[name, "random"]),
        )
        for name, one in rests.items()
    ]


def _outcomes(
    rests: Mapping[str, Mapping[str, Sequence[Comparison]]],
) -> dict[tuple[str, str], list[rules.Judged]]:
    """Of every point and trend, the comparisons as they are judged together."""
    findings = {
        (name, trend): [each.finding() for each in found]
        for name, one in rests.items()
        for trend, found in one.items()
    }
    judged = iter(rules.judge([each for found in findings.values() for each in found]))
    return {key: [next(judged) for _ in found] for key, found in findings.items()}


def _text(judged: rules.Judged) -> str:
    return f"{judged.finding.label}: {judged.measured}"


def together(outcomes: Sequence[Outcome]) -> Outcome:
    """What the comparisons say of their trend: any refuted, all confirmed, else open."""
    if Outcome.NO in outcomes:
        return Outcome.NO
    return Outcome.YES if all(each is Outcome.YES for each in outcomes) else Outcome.OPEN


def run(tasks: Mapping[Any, Task], settings: Settings) -> dict[Any, Curves]:
    """Curves by name, computed where they are missing; a point where learning diverges has none."""
    parts = [(task, variation) for task in tasks.values() for variation in VARIATIONS]
    for _ in experiments.fan_out(partial(_kept, settings=settings), parts, settings):
        pass
    found = {
        name: {variation: _kept((task, variation), settings) for variation in VARIATIONS}
        for name, task in tasks.items()
    }
    return {name: curves for name, curves in found.items() if all(each.size for each in curves.values())}


def curves_of(task: Task, variation: str, settings: Settings) -> NDArray[np.float64]:
    """Return and e_total of every episode in a variation, (2, replicates, episodes)."""
    size = () if settings.scale == "paper" else SCALES[settings.scale]["advection"]
    one = mission(composed(["experiment=advection", *size, *overrides(task.point), *VARIATIONS[variation]]))
    seed = task.seed
    if task.agent == "random":
        one, seed = replace(one, agent=Random()), seed + _CHANCE + 10 * list(VARIATIONS).index(variation)
    found = [_learned(Replicate(one, seed, number)) for number in range(task.replicates)]
    return np.array(found).swapaxes(0, 1)


def _learned(run: Replicate) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return and e_total of a replicate's episodes, (episodes,) each."""
    for episode in range(run.mission.episodes):
        run.learn(episode)
    return run.learning.values["reward"].sum(axis=1), run.learning.values["e_total"][:, -1]


def _kept(part: tuple[Task, str], settings: Settings) -> NDArray[np.float64]:
    task, variation = part
    parts = [_VERSION, settings.scale, *overrides(task.point), *task[1:], variation]
    return experiments.kept(settings, "figure_3", parts, partial(_tolerant, *part, settings))["values"].values


def _tolerant(task: Task, variation: str, settings: Settings) -> xr.Dataset:
    """Nothing where learning diverges."""
    try:
        values = curves_of(task, variation, settings)
    except LearningDiverged:
        values = np.empty((2, 0, 0))
    return xr.Dataset({"values": (("quantity", "replicate", "episode"), values)})


def show(judged: Sequence[Judged]) -> None:
    """Print trends, then what each rests on."""
    report.show("Figure 3's trends", COLUMNS, rows_of(judged))
    measured = [
        (f"{each.name}: {text}",) for each in judged for texts in each.measured.values() for text in texts
    ]
    report.show("What they rest on", ("first → last, paired difference [95 %]",), measured)


def rows_of(judged: Sequence[Judged]) -> list[list[str]]:
    """``COLUMNS`` of each: a word for every trend, and how many of them hold."""
    return [
        [
            each.name,
            f"{each.score:.2f}",
            *(_MARKS[outcome] for outcome in each.outcomes.values()),
            str(_held(each)),
            str(sum(each.chance.values())),
        ]
        for each in judged
    ]


def detailed(judged: Sequence[Judged]) -> str:
    """What every trend rests on, as a Markdown table with a column for each point."""
    rows = [[trend, *(_cell(each, trend) for each in judged)] for trend in TRENDS]
    rows.append(["trends that hold, of six", *(str(_held(each)) for each in judged)])
    return report.markdown(["the paper", *(each.name for each in judged)], rows)


def _cell(judged: Judged, trend: str) -> str:
    texts = (text.partition("; smallest")[0] for text in judged.measured[trend])
    return f"{MARKS[judged.outcomes[trend]]} {'<br>'.join(texts)}"


def _held(judged: Judged) -> int:
    return sum(outcome is Outcome.YES for outcome in judged.outcomes.values())


def plain(judged: Judged) -> dict[str, Any]:
    """As JSON has it."""
    outcomes = {trend: outcome.value for trend, outcome in judged.outcomes.items()}
    return judged._asdict() | {"point": described(judged.point), "outcomes": outcomes}


if __name__ == "__main__":
    experiments.command(make)
