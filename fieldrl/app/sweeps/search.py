"""``hydra/sweeper=gp``: a search of configuration values, one batch of jobs after the other."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import DictConfig

from fieldrl.app import files
from fieldrl.app.sweeps.composing import Composer
from fieldrl.app.sweeps.conduct import Conductor, Runner
from fieldrl.app.sweeps.drawing import draw_search
from fieldrl.app.sweeps.objective import Objective
from fieldrl.app.sweeps.proposals import Trial, propose
from fieldrl.app.sweeps.results import Row
from fieldrl.app.sweeps.space import Point, Space, space
from fieldrl.core import checks

_STATE = "trials.json"


@dataclass(frozen=True)
class Settings:
    """Of a search.

    Args:
        objective: what is searched for.
        n_trials: jobs in all, >= 1; a search that is repeated with more of them goes on.
        n_initial: how many of them are the initial design, >= 1.
        batch: how many are done at a time, >= 1; None: as many as there are workers.
        seed: of every random choice of the search, >= 0.
    """

    objective: Objective
    n_trials: int
    n_initial: int
    batch: int | None
    seed: int

    def __post_init__(self) -> None:
        checks.integer("hydra.sweeper.n_trials", self.n_trials, 1)
        checks.integer("hydra.sweeper.n_initial", self.n_initial, 1)
        checks.integer("hydra.sweeper.seed", self.seed, 0)
        if self.batch is not None:
            checks.integer("hydra.sweeper.batch", self.batch, 1)

    def method(self, batch: int) -> dict[str, Any]:
        """What decides which jobs there are; the number of trials only says when to stop."""
        return {
            "sweeper": "gp",
            "objective": self.objective.path,
            "direction": self.objective.direction,
            "n_initial": self.n_initial,
            "batch": batch,
            "seed": self.seed,
        }


def run(
    master: DictConfig, loader: Any, runner: Runner, arguments: Sequence[str], settings: Settings
) -> None:
    """Search.

    Args:
        master: the sweep's configuration, Hydra's node included.
        loader: Hydra's loader of configurations.
        runner: who does the jobs.
        arguments: the overrides as typed.
        settings: of the search.

    Raises:
        FieldrlError: the command line is refused, or a job failed.
    """
    searched = space(OverridesParser.create(config_loader=loader).parse_overrides(list(arguments)))
    batch = settings.batch or runner.workers
    conductor = Conductor(
        Composer(loader, master),
        runner,
        settings.objective,
        tuple(arguments),
        searched.keys,
        settings.method(batch),
        settings.n_trials,
    )
    try:
        trials = _search(conductor, searched, settings, batch)
        conductor.finish(partial(draw_search, trials=trials, space=searched, settings=settings))
    finally:
        conductor.close()


def _search(conductor: Conductor, searched: Space, settings: Settings, batch: int) -> list[Trial]:
    """Batch after batch until there are enough trials, or nothing is left to try."""
    trials: list[Trial] = []
    kept: list[Point] = []
    while len(trials) < settings.n_trials:
        left = settings.n_trials - len(trials)
        points = kept[:left] or propose(searched, trials, min(batch, left), settings.n_initial, settings.seed)
        if not points:
            break
        rows = conductor.batch([searched.overrides(point) for point in points], with_best=True)
        trials += [(point, _loss(row, settings.objective)) for point, row in zip(points, rows, strict=True)]
        kept = _kept(conductor, searched, trials)
        if not kept:
            _keep(conductor, settings.objective)
    return trials


def _loss(row: Row, objective: Objective) -> float | None:
    return None if row.value is None else objective.loss(row.value)


def _kept(conductor: Conductor, searched: Space, trials: Sequence[Trial]) -> list[Point]:
    """The points that this search tried next when it was run before; none where it went otherwise."""
    if conductor.sweep is None:
        return []
    try:
        content = json.loads((conductor.sweep.folder / _STATE).read_text())
        points = [
            searched.point([trial["values"][key] for key in searched.keys]) for trial in content["trials"]
        ]
    except (OSError, ValueError, KeyError, TypeError):  # no such file, or it is garbled
        return []
    before, after = points[: len(trials)], points[len(trials) :]
    if before != [point for point, _ in trials] or None in after:
        return []
    return [point for point in after if point is not None]


def _keep(conductor: Conductor, objective: Objective) -> None:
    """Write the list of trials, which is all that a search knows."""
    if conductor.sweep is None:
        return
    rows = [
        {"values": dict(row.varied), "run": row.name, objective.path: row.value, "reason": row.reason}
        for row in conductor.rows
    ]
    content = {"objective": objective.path, "direction": objective.direction, "trials": rows}
    conductor.sweep.write(_STATE, partial(files.write_text, json.dumps(content, indent=2) + "\n"))
