"""How much of the water, and of the agent's table, is seen in a run."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.mission import Mission
from pipelines.diagnosis.returns import any_paths, places

CELL = 10.0  # side of a cell [length]


def visits(task: Mission, positions: NDArray[np.float64]) -> NDArray[np.int64]:
    """Samples in every cell of the water, of positions (..., 2), (nx, ny)."""
    sides = list(zip(task.water.domain.lower, task.water.domain.upper, strict=True))
    bins = [round((high - low) / CELL) for low, high in sides]
    return np.histogram2d(*positions.reshape(-1, 2).T, bins=bins, range=sides)[0].astype(int)


def reachable(task: Mission, count: int) -> NDArray[np.float64]:
    """Where ``count`` paths lead, (count, steps, 2): what lies on none of them counts as out of reach."""
    return places(task, any_paths(task, count))


def of_water(
    task: Mission, record: xr.Dataset, reach: NDArray[np.float64], least: int
) -> NDArray[np.float64]:
    """Share of the cells in reach where a replicate took at least so many samples, (replicates,)."""
    within = visits(task, reach) > 0
    positions = record["position"].transpose("replicate", "episode", "step", "axis").values
    return np.array([float(np.mean(visits(task, each)[within] >= least)) for each in positions])


def of_table(
    task: Mission, record: xr.Dataset, reach: NDArray[np.float64], least: int
) -> NDArray[np.float64]:
    """Share of the (tile, action) pairs in reach that a replicate tried in so many steps, (replicates,)."""
    environment, actions = task.environment(), len(task.vehicle.actions)
    agent: Any = task.agent
    coder = agent.tile_coding.coder(environment.low, environment.high)

    def tiles(positions: NDArray) -> NDArray[np.int64]:
        """Active features where a step begins, (episodes * steps, tilings)."""
        start = np.broadcast_to(task.vehicle.start, (len(positions), 1, 2))
        begun = np.concatenate([start, positions[:, :-1]], axis=1).reshape(-1, 2)
        padded = np.column_stack([begun, np.zeros((len(begun), 2))])
        return np.array([agent.tile_coding.active(each, coder) for each in padded])

    within = np.zeros(agent.tile_coding.features, dtype=bool)
    within[tiles(reach)] = True
    positions = record["position"].transpose("replicate", "episode", "step", "axis").values
    taken = record["action"].transpose("replicate", "episode", "step").values
    shares = []
    for place, action in zip(positions, taken, strict=True):
        tried = np.zeros((actions, agent.tile_coding.features), dtype=int)
        np.add.at(tried, (action.reshape(-1, 1), tiles(place)), 1)
        shares.append(np.mean(tried[:, within] >= least))
    return np.array(shares)
