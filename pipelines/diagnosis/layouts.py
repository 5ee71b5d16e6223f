"""Returns of fixed paths, kept: those that the agents took, and the best of many."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core.streams import stream
from pipelines import experiments
from pipelines.diagnosis import returns
from pipelines.diagnosis.cases import PAPER, Case
from pipelines.diagnosis.learners import SEED, VERSION
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

_JUDGED = 10_000  # first draw of noise that the best path was not chosen by
_NAMES = ("best of the paths drawn", "nearest to the feature", "farthest from it", "engine off")


def layouts(found: dict[tuple[str, str, str], Found], settings: Settings) -> dict[tuple[str, str], NDArray]:
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


def paths(settings: Settings) -> dict[tuple[str, str], NDArray]:
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


def _judged(case: Case, settings: Settings, size: dict[str, Any]) -> NDArray:
    task = case.mission(settings)
    chosen = returns.chosen(task, size["candidates"], size["rounds"])
    paths = np.array([chosen[name] for name in _NAMES])
    return returns.play(task, paths, range(_JUDGED, _JUDGED + size["judge"]))


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
        settings, parts[0], [VERSION, settings.scale, *parts], lambda: _dataset(compute())
    )
    return made["values"].values


def _dataset(values: NDArray) -> xr.Dataset:
    return xr.Dataset({"values": (tuple("abc"[: values.ndim]), values)})
