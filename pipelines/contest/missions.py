"""The missions of a case: training, then tests on truths and noise that training has not seen."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pandas as pd

from fieldrl.cli.compose import composed
from fieldrl.core.streams import stream
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission import Mission
from fieldrl.mission.learning import Replicate
from fieldrl.runs.components import mission
from fieldrl.uncertainty import assess, noise_of
from pipelines.contest.cases import LEARNERS, Place, configuration

TRAINING = 0
"""Seed of training."""

COLUMNS = (
    "experiment", "start", "plume", "agent", "seed", "parameter_error", "field_error", "identified",
    "e_total", "seconds", "training_seconds",
)  # fmt: skip


def of(place: Place, agent: str, episodes: int, output_dir: str) -> Mission:
    """The mission of a case; what its model keeps is kept in ``output_dir``."""
    return mission(composed((*configuration(place, agent, episodes), f"output_dir={output_dir}")))


def missions(place: Place, agent: str, episodes: int, seeds: int, output_dir: str) -> pd.DataFrame:
    """One row for each test mission; seconds are those that the agent decided in.

    Besides ``COLUMNS``: error_1, error_2, ..., the parameter error after each sample.

    Args:
        place: where.
        agent: option of the group.
        episodes: that it trains, if it learns.
        seeds: how many test missions; mission k has streams of its own, the same for every agent.
        output_dir: see ``of``.
    """
    replicate = Replicate(of(place, agent, episodes, output_dir), TRAINING, 0)
    began = time.perf_counter()
    if agent in LEARNERS:
        for episode in range(episodes):
            replicate.learn(episode)
    where = {"experiment": place.experiment, "start": place.start, "plume": place.plume, "agent": agent}
    training = {"training_seconds": time.perf_counter() - began if agent in LEARNERS else 0.0}
    rows = [where | {"seed": seed} | _test(replicate, seed) | training for seed in range(seeds)]
    table = pd.DataFrame(rows)
    return table.reindex(columns=[*COLUMNS, *table.columns.difference(COLUMNS, sort=False)])


def _test(replicate: Replicate, seed: int) -> dict[str, Any]:
    """One mission of the frozen greedy policy, and what its samples told."""
    environment, rng = replicate.environment, stream(seed, "contest decisions")
    environment.np_random = stream(seed, "contest sensor")
    environment.chance = stream(seed, "contest truth")
    observation, _ = environment.reset()
    state, seconds, info, errors = replicate.agent_state, 0.0, {}, {}
    for sample in range(1, environment.steps + 1):
        began = time.perf_counter()
        action = replicate.choose(state, observation, rng, greedy=True)
        seconds += time.perf_counter() - began
        observation, _, _, _, info = environment.step(action)
        errors[f"error_{sample}"] = float(environment.parameters.distance(info["theta"]))
    return _told(replicate, info) | {"seconds": seconds} | errors


def _told(replicate: Replicate, info: dict[str, Any]) -> dict[str, Any]:
    environment, theta = replicate.environment, info["theta"]
    water, samples = environment.water, environment.samples
    problem = FitProblem(water, samples, environment.estimator.tikhonov, False)
    known = assess(problem, theta, noise_of(samples, environment.vehicle.sensor.noise))
    truth = water.truth()
    true = truth.field(environment.theta, environment.time, truth.grid)
    difference = water.field(theta, environment.time, truth.grid) - true  # type: ignore[attr-defined]
    return {
        "parameter_error": float(water.parameters.distance(theta)),
        "field_error": float(np.sqrt(np.nanmean(difference**2))),
        "identified": int(known.identified.all()),
        "e_total": info["e_total"],
    }
