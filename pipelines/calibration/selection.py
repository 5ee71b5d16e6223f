"""What choosing the best of many episodes does to its interval.

Of each run the episode of least e_total is judged, the first for comparison, and all samples together.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.estimator.problem import FitProblem, errors
from fieldrl.uncertainty import Noise, assess
from pipelines.calibration.cases import holds
from pipelines.calibration.missions import SEED, World

EPISODES = 40
STEPS = 10
"""Samples of an episode: the first of its path."""

HOW = ("noise known", "noise estimated from its samples", "from all samples")
"""Where the size of the noise comes from; fieldrl takes the first, where it is not known the last."""


def judge(world: World, number: int) -> list[dict[str, Any]]:
    """Run ``number``: a truth, ``EPISODES`` paths, and whether the intervals of 95 % hold the truth."""
    truth, *parts = world.run(number, EPISODES)
    positions, times, clean = (part[:, :STEPS] for part in parts)
    water, tikhonov = world.water, world.mission.estimator.tikhonov
    rng = stream(SEED, "calibration noise of runs", number)
    values = clean + world.noise * rng.standard_normal(clean.shape)

    def problem(at: Any, folds: bool = False) -> FitProblem:
        return FitProblem(water, Samples.of(positions[at], times[at], values[at]), tikhonov, folds)

    fits = [world.mission.estimator.fit(problem(e, True)) for e in range(EPISODES)]
    best = int(np.argmin([errors(fit).e_total for fit in fits]))
    every = problem(slice(None))
    pooled = world.mission.estimator.fit(every).theta[0]
    paths = np.repeat(np.arange(EPISODES), STEPS)

    def covered(at: FitProblem, theta: NDArray, noise: Noise, paths: NDArray | None = None) -> list[bool]:
        return holds(assess(at, theta, noise, paths=paths), truth)

    known, unknown = (Noise(np.full(STEPS, world.noise), known) for known in (True, False))
    known_all, unknown_all = (Noise(np.full(times.size, world.noise), known) for known in (True, False))
    least = assess(every, pooled, unknown_all, paths=paths).least
    p = len(truth)
    told = replace(unknown, elsewhere=(unknown_all.variance(least, p), unknown_all.free(p)))
    found: dict[str, Any] = {"run": number}
    for name, e in (("best", best), ("first", 0)):
        for how, noise in zip(HOW, (known, unknown, told), strict=True):
            found[f"{name}, {how}"] = covered(problem(e), fits[e].theta[0], noise)
    for how, noise in zip(HOW, (known_all, unknown_all), strict=False):
        found[f"pooled, {how}"] = covered(every, pooled, noise, paths)
    return [found]
