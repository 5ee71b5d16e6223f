"""Everything that the tables show, computed or found: learning runs, recorded runs, layouts, paths."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.agent.random import Random
from fieldrl.core.streams import stream
from pipelines import experiments
from pipelines.diagnosis import chain, coverage, learners, returns
from pipelines.diagnosis.cases import CONTROLS, FREE, PAPER, REPLICATES, SETTINGS, Case, runs
from pipelines.diagnosis.learners import SEED, Part
from pipelines.experiments import Found, Settings
from pipelines.measures import late

SIZES = {
    "paper": {
        "paths": 60,
        "draws": 60,
        "candidates": 400,
        "judge": 400,
        "rounds": ((8, 40), (40, 5), (200, 1)),
    },
    "small": {"paths": 4, "draws": 4, "candidates": 6, "judge": 4, "rounds": ((2, 3), (2, 1))},
}
"""Of layouts, and of the search for the best path: paths drawn, draws of noise to judge it, its rounds."""

CHAIN = {
    "no noise": (100.0, 0.0),
    "noise, size 100": (100.0, 25.0),
    "noise, size 20": (20.0, 25.0),
    "noise, size 5": (5.0, 25.0),
}
"""Size of the reward, and standard deviation of its noise."""

_JUDGED = 10_000  # first draw of noise that the best path was not chosen by


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
        layouts=_layouts(found, settings),
        paths=_paths(settings),
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


def _layouts(found: dict[tuple[str, str, str], Found], settings: Settings) -> dict[tuple[str, str], NDArray]:
    """Returns of paths that the agents took in late episodes."""
    size = SIZES[settings.scale]
    wanted = {}
    for (estimator, setting, agent), run in found.items():
        if setting == "limited":
            taken = run.record["action"].transpose("replicate", "episode", "step").values
            taken = late(taken).reshape(-1, taken.shape[-1])
            drawn = stream(SEED, "diagnosis layout").choice(len(taken), min(size["paths"], len(taken)), False)
            name = ["layout", run.key, size["paths"], size["draws"]]
            task = partial(_layout, PAPER[estimator], settings, taken[drawn], size["draws"])
            wanted[estimator, agent] = (name, task)
    return {key: values.sum(axis=0) for key, values in _all(wanted, settings).items()}


def _layout(case: Case, settings: Settings, paths: NDArray, draws: int) -> NDArray:
    return returns.play(case.mission(settings), paths, range(draws))


def _paths(settings: Settings) -> dict[tuple[str, str], NDArray]:
    """Returns of some paths with noise that none was chosen by."""
    size = SIZES[settings.scale]
    wanted = {
        (estimator,): (
            ["paths", *case.parts, *map(str, size.values())],
            partial(_judged, case, settings, size),
        )
        for estimator, case in PAPER.items()
    }
    return {
        (estimator, name): values[:, i]
        for (estimator,), values in _all(wanted, settings).items()
        for i, name in enumerate(_NAMES)
    }


_NAMES = ("best of the paths drawn", "nearest to the feature", "farthest from it", "engine off")


def _judged(case: Case, settings: Settings, size: dict[str, Any]) -> NDArray:
    task = case.mission(settings)
    chosen = returns.chosen(task, size["candidates"], size["rounds"])
    paths = np.array([chosen[name] for name in _NAMES])
    return returns.play(task, paths, range(_JUDGED, _JUDGED + size["judge"]))


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
        reach = coverage.reachable(task, 50 * SIZES[settings.scale]["paths"])
        shares[key] = {
            "cells": coverage.of_water(task, run.record, reach, 1),
            "cells, 10 samples": coverage.of_water(task, run.record, reach, 10),
            "pairs": coverage.of_table(task, run.record, reach, 1),
            "pairs, 10 times": coverage.of_table(task, run.record, reach, 10),
        }
    return shares


def _all(
    wanted: dict[Any, tuple[list[Any], Callable[[], NDArray]]], settings: Settings
) -> dict[Any, NDArray]:
    """Arrays by name, each computed once from the parts that it depends on, and kept."""
    for _ in experiments.fan_out(partial(_one, settings=settings), list(wanted.values()), settings):
        pass
    return {name: _one(each, settings) for name, each in wanted.items()}


def _one(each: tuple[list[Any], Callable[[], NDArray]], settings: Settings) -> NDArray:
    parts, compute = each
    made = experiments.kept(
        settings, parts[0], [learners.VERSION, settings.scale, *parts], lambda: _dataset(compute())
    )
    return made["values"].values


def _dataset(values: NDArray) -> xr.Dataset:
    return xr.Dataset({"values": (tuple("abc"[: values.ndim]), values)})
