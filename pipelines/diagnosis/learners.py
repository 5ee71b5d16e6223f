"""Learning runs of the cases, some replicates of each, kept as they are done; their value functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.agent.random import Random
from fieldrl.mission import Mission
from fieldrl.mission.learning import Replicate
from fieldrl.pde.tracer import predicted_place
from pipelines import experiments
from pipelines.diagnosis.cases import Case
from pipelines.experiments import Settings

SEED = 0
VERSION = 1
"""Of what is kept; raise it when the same case gives other numbers."""

_CELLS = 40  # along each side of the water, of a value function


class Part(NamedTuple):
    """Some replicates of a case.

    Args:
        case: what is learned.
        agent: "learner", or "random" for the random agent.
        replicates: how many.
    """

    case: Case
    agent: str
    replicates: int


def find(parts: Mapping[Any, Part], settings: Settings) -> dict[Any, xr.Dataset]:
    """What each part leaves, computed first where it is missing; see ``learned``."""
    todo = list(dict.fromkeys(parts.values()))
    for _ in experiments.fan_out(partial(_ensure, settings=settings), todo, settings):
        pass
    return {name: _kept(part, settings) for name, part in parts.items()}


def learned(part: Part, settings: Settings) -> xr.Dataset:
    """Let the replicates of a part learn.

    Returns:
        ``return``, ``e_total`` after the last sample, ``distance``, the mean one between vehicle and feature
        [length], (replicate, episode); of a learner, ``value``, its greedy value at the end, (replicate, x,
        y), NaN where the vehicle has never been.
    """
    task = part.case.mission(settings)
    task = replace(task, agent=Random()) if part.agent == "random" else task
    runs = [_learn(task, number) for number in range(part.replicates)]
    found = {"return": [run.learning.values["reward"].sum(axis=1) for run in runs]}
    found["e_total"] = [run.learning.values["e_total"][:, -1] for run in runs]
    found["distance"] = [distances(task, run.learning.values["position"]) for run in runs]
    data: dict[str, Any] = {
        name: (("replicate", "episode"), np.array(values)) for name, values in found.items()
    }
    if part.agent == "learner":
        data["value"] = (("replicate", "x", "y"), np.array([value(task, run) for run in runs]))
    return xr.Dataset(data)


def distances(task: Mission, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean distance to the feature's true centre along paths, (..., steps, 2) -> (...) [length]."""
    true = np.array(task.water.parameters.true)
    times = (np.arange(positions.shape[-2]) + 1) * task.vehicle.time_step
    centres = np.array([predicted_place(task.water, true, time) for time in times])
    return np.linalg.norm(positions - centres, axis=-1).mean(axis=-1)


def value(task: Mission, run: Replicate) -> NDArray[np.float64]:
    """The greatest action value over the water, at heading and time 0, (x, y)."""
    agent: Any = task.agent
    weights, coder = run.agent_state["weights"], run.agent_state["coder"]
    grid = task.water.domain.grid(_CELLS, _CELLS)
    states = np.column_stack([grid.points, np.zeros((len(grid.points), 2))])
    active = np.array([agent.tile_coding.active(state, coder) for state in states])
    greatest = weights[:, active].sum(axis=-1).max(axis=0)
    return np.where(_seen(task, run), greatest.reshape(_CELLS, _CELLS), np.nan)


def agreement(values: NDArray[np.float64]) -> float:
    """Median correlation of the value functions (r, x, y) of two replicates, where both have been."""
    flat = values.reshape(len(values), -1)
    pairs = [(one, other) for i, one in enumerate(flat) for other in flat[:i]]
    return float(np.median([_correlation(*pair) for pair in pairs]))


def _correlation(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Of two (n,), where both are finite; 0 where that says nothing."""
    both = np.isfinite(one) & np.isfinite(other)
    one, other = one[both], other[both]
    if both.sum() < 2 or np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def _learn(task: Mission, number: int) -> Replicate:
    run = Replicate(task, SEED, number)
    for episode in range(task.episodes):
        run.learn(episode)
    return run


def _seen(task: Mission, run: Replicate) -> NDArray[np.bool_]:
    """Whether a cell is one in which a sample was taken, (cells, cells)."""
    places = run.learning.values["position"].reshape(-1, 2)
    domain = task.water.domain
    sides = list(zip(domain.lower, domain.upper, strict=True))
    return np.histogram2d(*places.T, bins=_CELLS, range=sides)[0] > 0


def _kept(part: Part, settings: Settings) -> xr.Dataset:
    task = part.case.mission(settings)
    parts = [VERSION, *part.case.parts, part.agent, part.replicates, task.episodes, task.steps]
    return experiments.kept(settings, "learned", parts, partial(learned, part, settings))


def _ensure(part: Part, settings: Settings) -> None:
    _kept(part, settings)
