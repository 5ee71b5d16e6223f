"""``hydra/sweeper=gp``: a search of configuration values, one batch of jobs after the other."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from fieldrl.core import checks
from fieldrl.runs.folder import json_of
from fieldrl.sweeps.execution import Execution
from fieldrl.sweeps.objective import Objective
from fieldrl.sweeps.pictures import draw_search
from fieldrl.sweeps.proposals import Trial, propose
from fieldrl.sweeps.space import Point, Space

_TRIALS = "trials.json"


@dataclass(frozen=True)
class Search:
    """Settings of a search.

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

    def method(self, workers: int) -> dict[str, Any]:
        """What decides which jobs there are; the number of trials only says when to stop."""
        compared = {"objective": self.objective.path, "direction": self.objective.direction}
        design = {"n_initial": self.n_initial, "batch": self.batch or workers, "seed": self.seed}
        return {"sweeper": "gp", **compared, **design}


def run(execution: Execution, space: Space, search: Search) -> None:
    """Search batch after batch until there are enough trials, or nothing is left to try.

    Args:
        execution: of the sweep.
        space: what is searched.
        search: its settings.

    Raises:
        FieldrlError: every job of the first batch is refused, or a job failed.
    """
    trials: list[Trial] = []
    try:
        before: list[Point] = []
        while len(trials) < search.n_trials:
            left = search.n_trials - len(trials)
            batch = min(execution.method["batch"], left)
            points = before[:left] or propose(space, trials, batch, search.n_initial, search.seed)
            if not points:
                break
            jobs = execution.batch([space.overrides(point) for point in points], tell_reused=True)
            losses = (None if job.value is None else search.objective.loss(job.value) for job in jobs)
            trials += zip(points, losses, strict=True)
            before = _tried_before(execution, space, trials)
            if not before:
                _write(execution, search.objective)
        settings = {"objective": search.objective, "initial": search.n_initial, "seed": search.seed}
        execution.finish(partial(draw_search, trials=trials, space=space, **settings))
    finally:
        execution.close()


def _tried_before(execution: Execution, space: Space, trials: Sequence[Trial]) -> list[Point]:
    """The points that this search tried next when it was run before; none where it went otherwise."""
    content = json_of(execution.sweep.folder / _TRIALS) if execution.sweep else {}
    try:
        points = [space.point([trial["values"][key] for key in space.keys]) for trial in content["trials"]]
    except (KeyError, TypeError, AttributeError):  # no such file, or it is garbled
        return []
    before, after = points[: len(trials)], [point for point in points[len(trials) :] if point is not None]
    same = before == [point for point, _ in trials] and len(before) + len(after) == len(points)
    return after if same else []


def _write(execution: Execution, objective: Objective) -> None:
    """Write the list of trials, which is all that a search knows."""
    rows = [
        {"values": dict(job.varied), "run": job.name, objective.path: job.value, "reason": job.reason}
        for job in execution.jobs
    ]
    content = {"objective": objective.path, "direction": objective.direction, "trials": rows}
    if execution.sweep is not None:
        execution.sweep.write(_TRIALS, json.dumps(content, indent=2) + "\n")
