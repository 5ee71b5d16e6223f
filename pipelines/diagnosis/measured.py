"""Everything that the tables show, computed or found: learning runs, recorded runs, layouts, paths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.agent.random import Random
from pipelines import experiments
from pipelines.diagnosis import chain, coverage, layouts, learners
from pipelines.diagnosis.cases import CONTROLS, FREE, PAPER, REPLICATES, SETTINGS, Case, runs
from pipelines.diagnosis.learners import Part
from pipelines.experiments import Found, Settings
from pipelines.measures import late

CHAIN = {
    "no noise": (100.0, 0.0),
    "noise, size 100": (100.0, 25.0),
    "noise, size 20": (20.0, 25.0),
    "noise, size 5": (5.0, 25.0),
}
"""Size of the reward, and standard deviation of its noise."""


_REACH = {"paper": 3000, "small": 200}  # paths that tell what is in reach


class Measured(NamedTuple):
    """What was measured.

    Args:
        parts: learning runs by name and agent ("learner" or "random").
        runs: recorded runs by estimator, setting and agent.
        layouts: returns (k, m) of the late paths of an agent, by estimator and agent.
        paths: returns at the last sample and before it, (2, m), by estimator and path.
        chain: ends of late episodes of each replicate, (2, r): learner's, random agent's; by case.
        seen: shares (r,) by agent and what is counted.
        noise: standard deviation of the controls' noise.
    """

    parts: dict[tuple[str, str], xr.Dataset]
    runs: dict[tuple[str, str, str], Found]
    layouts: dict[tuple[str, str], NDArray[np.float64]]
    paths: dict[tuple[str, str], NDArray[np.float64]]
    chain: dict[str, NDArray[np.float64]]
    seen: dict[tuple[str, str, str], dict[str, NDArray[np.float64]]]
    noise: float


def measure(settings: Settings) -> Measured:
    """Everything; what is missing is computed."""
    found = experiments.find(runs(settings), settings)
    task = Case().mission(settings)
    return Measured(
        parts=learners.find(_parts(settings), settings),
        runs=found,
        layouts=layouts.layouts(found, settings),
        paths=layouts.paths(settings),
        chain=_chain(settings),
        seen=_seen(found, settings),
        noise=noise(task.steps),
    )


def noise(steps: int) -> float:
    """Standard deviation of 100 / (2 mean eps^2), of ``steps`` >= 5 normal errors with variance 1."""
    return 50.0 * steps * np.sqrt(2.0 / ((steps - 2) ** 2 * (steps - 4)))


def _parts(settings: Settings) -> dict[tuple[str, str], Part]:
    count = REPLICATES[settings.scale]
    found = {(name, "learner"): Part(case, "learner", count) for name, case in (CONTROLS | PAPER).items()}
    first = next(iter(CONTROLS.values()))
    free = next(case for case in CONTROLS.values() if FREE in case.overrides)
    return found | {
        ("limited", "random"): Part(first, "random", count),
        ("free", "random"): Part(free, "random", count),
    }


def _chain(settings: Settings) -> dict[str, NDArray]:
    task = Case().mission(settings)
    found = {}
    for name, (size, error) in CHAIN.items():
        found[name] = np.array(
            [
                [
                    late(chain.ends(agent, size, error, i, task.episodes)[None]).mean()
                    for i in range(REPLICATES[settings.scale])
                ]
                for agent in (task.agent, Random())
            ]
        )
    return found


def _seen(
    found: dict[tuple[str, str, str], Found], settings: Settings
) -> dict[tuple[str, str, str], dict[str, NDArray]]:
    """Coverage of the recorded runs."""
    shares = {}
    for key, run in found.items():
        task = Case(SETTINGS[key[1]][0]).mission(settings)
        reach = coverage.reachable(task, _REACH[settings.scale])
        shares[key] = {
            "cells": coverage.of_water(task, run.record, reach, 1),
            "cells, 10 samples": coverage.of_water(task, run.record, reach, 10),
            "pairs": coverage.of_table(task, run.record, reach, 1),
            "pairs, 10 times": coverage.of_table(task, run.record, reach, 10),
        }
    return shares
