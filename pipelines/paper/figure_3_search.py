"""Which settings that the paper leaves unsaid reproduce figure 3: a search, judged with noise of its own.

    python -m pipelines.paper.figure_3_search [scale=small] [output_dir=FOLDER] [jobs=N]

The platform's search (``hydra/sweeper=gp``) maximises the score of figure 3's six trends over the settings
of ``figure_3_space``, two replicates of five variations at each point, with noise of the point's own: noise
that all points share would be searched too. The best points are run again with six replicates and other
noise; the best of these are judged with another seed, beside those that are named, as in
``figure_3_settings``. Agents that act at random, each variation with noise of its own, show what trends and
scores chance alone gives. More points (``SIZES``) go on from those that are done.

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
from pipelines.paper.figure_3_settings import COLUMNS, Judged, Task, judge, plain, rows_of, run, show
from pipelines.paper.figure_3_space import NAMED, SPACE, described, named
from pipelines.paper.figure_3_trends import TRENDS, Curves, score, seeming

SIZES = {
    "paper": {"trials": 60, "initial": 20, "batch": 4, "replicates": 2, "chance": 20}
    | {"again": 12, "replicates_again": 6, "best": 3},
    "small": {"trials": 3, "initial": 2, "batch": 2, "replicates": 2, "chance": 1}
    | {"again": 2, "replicates_again": 2, "best": 1},
}
"""Points that are tried, of which an initial design, with replicates of each; how many of them are tried with
agents that act at random; how many are run again, with how many replicates; how many of these are judged."""

SEED = 0
"""Of the search's proposals."""

_SEEDS = 100  # how far apart those of points are


def make(settings: Settings) -> list[Judged]:
    """Search, judge, print, draw; returns what was judged."""
    size = SIZES[settings.scale]
    trials = search(settings)
    points = [point for point, _ in trials]
    tried = _tried(points, "learner", settings)
    chance = _tried(points[: size["chance"]], "random", settings)
    judged = judge(chosen(_again(trials, settings), size["best"]), settings)
    show(judged)
    _summary("learners", tried)
    _summary("agents at random", chance)
    at = {each.name: described(each.point) for each in judged}
    where = [[key, *(point[key] for point in at.values())] for key in SPACE.keys]
    report.show("Where they are", ("", *at), where)
    tables = report.markdown(COLUMNS, rows_of(judged)), report.markdown(("setting", *at), where)
    artefacts.put(settings, "figure_3_search.md", "\n".join(tables).encode())
    seen, by_chance = ([seeming(curves) for curves in found.values()] for found in (tried, chance))
    drawing = figure_3_drawing.draw(list(tried), seen, by_chance, [each.point for each in judged])
    numbers = {
        "judged": [plain(each) for each in judged],
        "searched": [_plain(point, curves) for point, curves in tried.items()],
        "chance": [_plain(point, curves) for point, curves in chance.items()],
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
        found = _tried(points, "learner", settings, len(trials))
        trials += [(point, -score(found[point]) if point in found else None) for point in points]
    return trials


def _again(trials: Sequence[Trial], settings: Settings) -> list[Trial]:
    """The best of them with more replicates and other noise."""
    size = SIZES[settings.scale]
    points = _best(trials, size["again"])
    tasks = {
        point: Task(point, "learner", _SEEDS * i + _SEEDS // 2, size["replicates_again"])
        for i, point in enumerate(points, 1)
    }
    return [(point, -score(curves)) for point, curves in run(tasks, settings).items()]


def chosen(trials: Sequence[Trial], best: int) -> dict[str, Point]:
    """Points that are judged, by name: those that are named, and the best."""
    found = {f"best {place}": point for place, point in enumerate(_best(trials, best), 1)}
    return {name: named(each) for name, each in NAMED.items()} | found


def _best(trials: Sequence[Trial], count: int) -> list[Point]:
    ranked = sorted((loss, i) for i, (_, loss) in enumerate(trials) if loss is not None)
    return [trials[i][0] for _, i in ranked[:count]]


def _tried(points: Sequence[Point], agent: str, settings: Settings, first: int = 0) -> dict[Point, Curves]:
    """Curves of points, of which so many were tried before."""
    replicates = SIZES[settings.scale]["replicates"]
    numbered = enumerate(points, first + 1)
    return run({point: Task(point, agent, _SEEDS * i, replicates) for i, point in numbered}, settings)


def _summary(text: str, found: Mapping[Point, Curves]) -> None:
    """Scores, and at how many points how many trends seem to hold."""
    scores = [score(curves) for curves in found.values()]
    counts = np.bincount(
        [sum(seeming(curves).values()) for curves in found.values()], minlength=len(TRENDS) + 1
    )
    print(f"{text}, {len(found)} points: score {report.spread(scores, 2)}, greatest {max(scores):.2f}")
    print(f"  points where 0, 1, ... {len(TRENDS)} trends seem to hold: {', '.join(map(str, counts))}")


def _plain(point: Point, curves: Curves) -> dict[str, Any]:
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
