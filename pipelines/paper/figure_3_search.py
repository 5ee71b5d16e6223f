"""Which settings that the paper leaves unsaid reproduce figure 3: a search, judged with noise of its own.

    python -m pipelines.paper.figure_3_search [scale=small] [output_dir=FOLDER] [jobs=N]

The platform's search (``hydra/sweeper=gp``) maximises the score of figure 3's six trends over the settings
of ``figure_3_space``, two replicates of five variations at each point. The best points and some that are
named are then run with another seed, 12 replicates each, and every comparison is judged as the paper's claims
are, corrected for all of them. Agents that act at random, each variation with noise of its own, show what
trends and scores chance alone gives. More points (``SIZES``) go on from those that are done.

Takes a quarter of an hour.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from fieldrl.agent.random import Random
from fieldrl.agent.sarsa_lambda import LearningDiverged
from fieldrl.cli.compose import composed
from fieldrl.mission.learning import Replicate
from fieldrl.runs.components import mission
from fieldrl.sweeps.proposals import Trial, propose
from fieldrl.sweeps.space import Point
from pipelines import artefacts, experiments, report
from pipelines.experiments import SCALES, Settings
from pipelines.paper import figure_3_drawing, rules
from pipelines.paper.figure_3_space import NAMED, SPACE, described, named, overrides
from pipelines.paper.figure_3_trends import TRENDS, VARIATIONS, Curves, score, seeming, trends
from pipelines.paper.rules import Outcome

SIZES = {
    "paper": {
        "trials": 28, "initial": 16, "batch": 4, "replicates": 2, "chance": 6,
        "best": 2, "others": 0, "judging": 12,
    },
    "small": {
        "trials": 3, "initial": 2, "batch": 2, "replicates": 2, "chance": 1,
        "best": 1, "others": 1, "judging": 2,
    },
}  # fmt: skip
"""Points that are tried, of which an initial design, with replicates of each; how many of them are tried with
agents that act at random; which are judged (the best, others of the design), with how many replicates."""

SEARCHED, JUDGED = 0, 1
"""Seeds of the search and of the judgement."""

MARKS = {Outcome.YES: "yes", Outcome.NO: "no", Outcome.OPEN: "open"}
_CHANCE = 1000  # first seed of random agents, one for each variation
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
        searched: its score in the search; NaN where it was not part of it.
        score: with the noise of the judgement.
        outcomes: of each trend.
        measured: of each trend, its comparisons as text.
        chance: which trends seem to hold with agents that act at random.
    """

    name: str
    point: Point
    searched: float
    score: float
    outcomes: dict[str, Outcome]
    measured: dict[str, list[str]]
    chance: dict[str, bool]


def make(settings: Settings) -> list[Judged]:
    """Search, judge, print, draw; returns what was judged."""
    size = SIZES[settings.scale]
    trials = search(settings)
    tried = _searched([point for point, _ in trials], "learner", settings)
    chance = _searched([point for point, _ in trials[: size["chance"]]], "random", settings)
    judged = judge(chosen(trials, size), trials, settings)
    seen, by_chance = ([seeming(curves) for curves in found.values()] for found in (tried, chance))
    _show(judged, tried, chance)
    drawing = figure_3_drawing.draw(list(tried), seen, by_chance, [each.point for each in judged])
    numbers = {
        "judged": [_described(each) for each in judged],
        "searched": [_tried(point, curves) for point, curves in tried.items()],
        "chance": [_tried(point, curves) for point, curves in chance.items()],
    }
    artefacts.save(settings, "figure_3_search", drawing, _caption(len(tried), size), [], numbers)
    return judged


def search(settings: Settings) -> list[Trial]:
    """Points that were tried, with minus their score."""
    size = SIZES[settings.scale]
    trials: list[Trial] = []
    while len(trials) < size["trials"]:
        count = min(size["batch"], size["trials"] - len(trials))
        points = propose(SPACE, trials, count, size["initial"], SEARCHED)
        if not points:
            break
        found = _searched(points, "learner", settings)
        trials += [(point, -score(found[point]) if point in found else None) for point in points]
    return trials


def chosen(trials: Sequence[Trial], size: Mapping[str, int]) -> dict[str, Point]:
    """Points that are judged, by name: those that are named, the best, the first of the design."""
    ranked = sorted((loss, i) for i, (_, loss) in enumerate(trials) if loss is not None)
    best = {f"best {place}": trials[i][0] for place, (_, i) in enumerate(ranked[: size["best"]], 1)}
    design = (point for point, loss in trials if loss is not None and point not in best.values())
    others = {f"other {place}": point for place, point in enumerate(islice(design, size["others"]), 1)}
    return {name: named(each) for name, each in NAMED.items()} | best | others


def judge(points: Mapping[str, Point], trials: Sequence[Trial], settings: Settings) -> list[Judged]:
    """The points with noise that none was chosen by, every comparison corrected for all of them."""
    size = SIZES[settings.scale]
    tasks: dict[tuple[str, str], Task] = {}
    for name, point in points.items():
        tasks[name, "learner"] = Task(point, "learner", JUDGED, size["judging"])
        tasks[name, "random"] = Task(point, "random", JUDGED, size["replicates"])
    curves = _all(tasks, settings)
    rests = {name: trends(curves[name, "learner"]) for name in points if (name, "learner") in curves}
    findings = {
        (name, trend): [each.finding() for each in found]
        for name, one in rests.items()
        for trend, found in one.items()
    }
    flat = iter(rules.judge([each for found in findings.values() for each in found]))
    outcomes = {key: [next(flat) for _ in found] for key, found in findings.items()}
    searched = {point: -loss for point, loss in trials if loss is not None}
    return [
        Judged(
            name, points[name], searched.get(points[name], float("nan")), score(curves[name, "learner"]),
            {trend: together([each.outcome for each in outcomes[name, trend]]) for trend in one},
            {trend: [_text(each) for each in outcomes[name, trend]] for trend in one},
            seeming(curves[name, "random"]),
        )
        for name, one in rests.items()
    ]  # fmt: skip


def _text(judged: rules.Judged) -> str:
    return f"{judged.finding.label}: {judged.measured}"


def together(outcomes: Sequence[Outcome]) -> Outcome:
    """What the comparisons say of their trend: any refuted, all confirmed, else open."""
    if Outcome.NO in outcomes:
        return Outcome.NO
    return Outcome.YES if all(each is Outcome.YES for each in outcomes) else Outcome.OPEN


def curves_of(task: Task, settings: Settings) -> xr.Dataset:
    """Return and e_total of a point's variations, (variation, 2, replicate, episode)."""
    found = [
        [_replicate(task, changes, settings, number, at) for number in range(task.replicates)]
        for at, changes in enumerate(VARIATIONS.values())
    ]
    values = np.array(found).swapaxes(1, 2)
    return xr.Dataset({"values": (("variation", "quantity", "replicate", "episode"), values)})


def _replicate(task: Task, changes: tuple[str, ...], settings: Settings, number: int, at: int) -> Any:
    """Return and e_total of every episode, (2, episodes); random agents have a seed for each variation."""
    size = () if settings.scale == "paper" else SCALES[settings.scale]["advection"]
    one = mission(composed(["experiment=advection", *size, *overrides(task.point), *changes]))
    random = task.agent == "random"
    one = replace(one, agent=Random()) if random else one
    run = Replicate(one, task.seed + (_CHANCE + 10 * at if random else 0), number)
    for episode in range(one.episodes):
        run.learn(episode)
    return run.learning.values["reward"].sum(axis=1), run.learning.values["e_total"][:, -1]


def _searched(points: Sequence[Point], agent: str, settings: Settings) -> dict[Point, Curves]:
    replicates = SIZES[settings.scale]["replicates"]
    return _all({point: Task(point, agent, SEARCHED, replicates) for point in points}, settings)


def _all(tasks: Mapping[Any, Task], settings: Settings) -> dict[Any, Curves]:
    """Curves by name, computed where they are missing; a point whose settings are refused has none."""
    for _ in experiments.fan_out(partial(_kept, settings=settings), list(tasks.values()), settings):
        pass
    found = {name: _kept(task, settings)["values"].values for name, task in tasks.items()}
    return {name: dict(zip(VARIATIONS, values, strict=True)) for name, values in found.items() if values.size}


def _kept(task: Task, settings: Settings) -> xr.Dataset:
    parts = [_VERSION, settings.scale, *overrides(task.point), *task[1:]]
    return experiments.kept(settings, "figure_3_search", parts, partial(_tolerant, task, settings))


def _tolerant(task: Task, settings: Settings) -> xr.Dataset:
    """Nothing where learning diverges."""
    try:
        return curves_of(task, settings)
    except LearningDiverged:
        return xr.Dataset({"values": (("variation",), np.empty(0))})


def _show(judged: Sequence[Judged], tried: Mapping[Point, Curves], chance: Mapping[Point, Curves]) -> None:
    rows = [
        (
            each.name, f"{each.searched:.2f}", f"{each.score:.2f}",
            *(MARKS[outcome] for outcome in each.outcomes.values()),
            f"{sum(outcome is Outcome.YES for outcome in each.outcomes.values())} of {len(TRENDS)}",
            f"{sum(each.chance.values())}",
        )
        for each in judged
    ]  # fmt: skip
    report.show(
        "Figure 3's trends, judged with other noise",
        ("", "search", "score", *TRENDS, "hold", "by chance"),
        rows,
    )
    for text, found in (("learners", tried), ("agents at random", chance)):
        _summary(text, list(found.values()))
    for each in judged:
        print(f"{each.name}: {', '.join(f'{key} {text}' for key, text in described(each.point).items())}")


def _summary(text: str, found: Sequence[Curves]) -> None:
    """Scores, and at how many points how many trends seem to hold."""
    scores = [score(curves) for curves in found]
    counts = np.bincount([sum(seeming(curves).values()) for curves in found], minlength=len(TRENDS) + 1)
    print(f"{text}, {len(found)} points: score {report.spread(scores, 2)}, greatest {max(scores):.2f}")
    print(f"  points where 0, 1, ... {len(TRENDS)} trends seem to hold: {', '.join(map(str, counts))}")


def _described(judged: Judged) -> dict[str, Any]:
    outcomes = {trend: outcome.value for trend, outcome in judged.outcomes.items()}
    return judged._asdict() | {"point": described(judged.point), "outcomes": outcomes}


def _tried(point: Point, curves: Curves) -> dict[str, Any]:
    return {**described(point), "score": score(curves), "trends": seeming(curves)}


def _caption(points: int, size: Mapping[str, int]) -> str:
    return (
        "Which settings that the paper leaves unsaid show the trends of figure 3. A-F: the "
        f"{points} points of a search, coloured by how many of the six trends seem to hold in "
        f"{size['replicates']} replicates; circles: one start for each fit, triangles: global fits; ringed: "
        "judged with other noise. G: how many points show so many trends, learners and agents that act at "
        "random. H: at how many points each trend seems to hold."
    )


if __name__ == "__main__":
    experiments.command(make)
