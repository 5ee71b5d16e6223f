"""What a mission will take, part by part, from the settings of its parts: nothing large is made for it."""

from __future__ import annotations

from typing import Any

from fieldrl.core.cost import DOUBLE, Cost, Extent, told
from fieldrl.mission.environment import Vehicle, Water
from fieldrl.mission.record import STEP_VARIABLES

_COPIES = 6  # of a replicate's log, on its way to the record's file
_REPLICATE = 0.05, 5e5  # time [s] and memory [bytes] of a replicate in which nothing happens
_STEP = 5e-5  # time of what belongs to no part [s]
BUDGET = ("replicates", "episodes", "steps", "evaluation_episodes")


def needs(
    water: Water, vehicle: Vehicle, agent: Any, estimator: Any, budget: dict[str, int], processes: int
) -> dict[str, Cost]:
    """What each part takes: memory of all processes together, time until all replicates are finished.

    Args:
        water: forward model, domain and flow.
        vehicle: kinematics and sensor.
        agent: what chooses.
        estimator: what concludes.
        budget: replicates, episodes, steps, evaluation_episodes.
        processes: how many replicates are computed at a time.
    """
    replicates, episodes, steps, evaluation = (budget[name] for name in BUDGET)
    p = len(water.parameters)
    extent = Extent(episodes + evaluation, steps, p, len(vehicle.actions))
    rounds = -(-replicates // processes)
    seconds, small = _REPLICATE
    log = DOUBLE * extent.samples * (len(STEP_VARIABLES) + 1 + p)
    record = Cost(replicates * (small + _COPIES * log), rounds * (seconds + extent.samples * _STEP), BUDGET)
    parts = {
        "water": told(water, extent),
        "vehicle": told(vehicle, extent),
        "agent": told(agent, extent),
        "estimator": told(estimator, extent, water),
    }
    return {name: cost.times(processes, rounds) for name, cost in parts.items()} | {"record": record}
