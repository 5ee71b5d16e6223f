"""Which settings that the paper leaves unsaid reproduce figure 3: a search, judged with noise of its own.

    python -m pipelines.paper.figure_3_search [scale=small] [output_dir=FOLDER] [jobs=N]

The platform's search (``hydra/sweeper=gp``) maximises the score of figure 3's six trends over the settings
of ``figure_3_space``, two replicates of five variations at each point. The best points are then judged with
another seed, beside those that are named, as in ``figure_3_settings``. Agents that act at random, each
variation with noise of its own, show what trends and scores chance alone gives. More points (``SIZES``) go on
from those that are done.

Takes half an hour.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fieldrl.sweeps.proposals import Trial, propose
from fieldrl.sweeps.space import Point
from pipelines import artefacts, experiments, report
from pipelines.experiments import Settings
from pipelines.paper import figure_3_drawing
from pipelines.paper.figure_3_settings import Judged, Task, judge, plain, run, show
from pipelines.paper.figure_3_space import NAMED, SPACE, described, named
from pipelines.paper.figure_3_trends import TRENDS, Curves, score, seeming

SIZES = {
    "paper": {"trials": 60, "initial": 20, "batch": 4, "replicates": 2, "chance": 20, "best": 3},
    "small": {"trials": 3, "initial": 2, "batch": 2, "replicates": 2, "chance": 1, "best": 1},
}
"""Points that are tried, of which an initial design, with replicates of each; how many of them are tried with
agents that act at random; how many of the best are judged."""

SEED = 0
"""Of the search."""


def make(settings: Settings) -> list[Judged]:
    """Search, judge, print, draw; returns what was judged."""
    size = SIZES[settings.scale]
    trials = search(settings)
    tried = _searched([point for point, _ in trials], "learner", settings)
    chance = _searched([point for point, _ in trials[: size["chance"]]], "random", settings)
    judged = judge(chosen(trials, size["best"]), settings)
    show(judged)
    _summary("learners", tried)
    _summary("agents at random", chance)
    for each in judged:
        print(f"{each.name}: {', '.join(f'{key} {text}' for key, text in described(each.point).items())}")
    seen, by_chance = ([seeming(curves) for curves in found.values()] for found in (tried, chance))
    drawing = figure_3_drawing.draw(list(tried), seen, by_chance, [each.point for each in judged])
    numbers = {
        "judged": [plain(each) for each in judged],
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
        points = propose(SPACE, trials, count, size["initial"], SEED)
        if not points:
            break
        found = _searched(points, "learner", settings)
        trials += [(point, -score(found[point]) if point in found else None) for point in points]
    return trials


def chosen(trials: Sequence[Trial], best: int) -> dict[str, Point]:
    """Points that are judged, by name: those that are named, and the best."""
    ranked = sorted((loss, i) for i, (_, loss) in enumerate(trials) if loss is not None)
    found = {f"best {place}": trials[i][0] for place, (_, i) in enumerate(ranked[:best], 1)}
    return {name: named(each) for name, each in NAMED.items()} | found


def _searched(points: Sequence[Point], agent: str, settings: Settings) -> dict[Point, Curves]:
    replicates = SIZES[settings.scale]["replicates"]
    return run({point: Task(point, agent, SEED, replicates) for point in points}, settings)


def _summary(text: str, found: Mapping[Point, Curves]) -> None:
    """Scores, and at how many points how many trends seem to hold."""
    scores = [score(curves) for curves in found.values()]
    counts = np.bincount(
        [sum(seeming(curves).values()) for curves in found.values()], minlength=len(TRENDS) + 1
    )
    print(f"{text}, {len(found)} points: score {report.spread(scores, 2)}, greatest {max(scores):.2f}")
    print(f"  points where 0, 1, ... {len(TRENDS)} trends seem to hold: {', '.join(map(str, counts))}")


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
