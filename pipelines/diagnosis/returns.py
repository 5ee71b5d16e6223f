"""What fixed paths return: by how much returns differ between paths, and by how much from noise alone.

A path is a sequence of actions; without noise of the vehicle's own state it always leads along the same
places, so what differs between two episodes of it is the noise of the samples. Every path is given the same
draws of it. In the two-way layout R_pd = mean + P_p + D_d + I_pd,

| symbol | meaning | shape |
|---|---|---|
| R | returns of k paths with the same m draws of noise | (k, m) |
| P, D, I | part of the path, of the noise, of both together; variances v_P, v_D, v_I | |
| f | root of v_P / (v_D + v_I): how far paths differ, in standard deviations of the noise | |

variances are those of the method of moments (Searle, Casella & McCulloch 1992, section 4.2); they may be
slightly negative where there is nothing, and count as 0 then.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from fieldrl.core.streams import stream
from fieldrl.mission import Mission
from pipelines.diagnosis.learners import SEED, distances

_RESAMPLES = 1000
_LEVEL, _POWER = 0.05, 0.8  # of a one-sided test that tells a path one v_P^1/2 better from the mean
_STAYS = 0.8  # chance that a persistent path repeats its action


class Parts(NamedTuple):
    """Variances of a two-way layout: of the path, of the noise, of both together."""

    path: float
    noise: float
    both: float

    @property
    def share(self) -> float:
        """Of the path, in the variance of a return."""
        return self.path / (self.path + self.noise + self.both)

    @property
    def effect(self) -> float:
        """f."""
        return float(np.sqrt(self.path / (self.noise + self.both)))

    @property
    def episodes(self) -> float:
        """How many of one path tell it from the mean path, were it better by one v_P^1/2; inf for none."""
        wanted = norm.isf(_LEVEL) + norm.ppf(_POWER)
        return float((wanted / self.effect) ** 2) if self.effect > 0 else float("inf")


def parts(returns: NDArray[np.float64]) -> Parts:
    """The variances of a layout (k, m), k and m >= 2."""
    k, m = returns.shape
    mean = returns.mean()
    path, noise = returns.mean(axis=1) - mean, returns.mean(axis=0) - mean
    both = np.sum((returns - mean - path[:, None] - noise) ** 2) / ((k - 1) * (m - 1))
    v_path, v_noise = np.sum(path**2) / (k - 1) - both / m, np.sum(noise**2) / (m - 1) - both / k
    return Parts(max(0.0, float(v_path)), max(0.0, float(v_noise)), float(both))


def effect_interval(returns: NDArray[np.float64]) -> tuple[float, float]:
    """95 % of f by the bootstrap over paths."""
    rng = stream(SEED, "diagnosis bootstrap")
    k = len(returns)
    found = [parts(returns[rng.integers(k, size=k)]).effect for _ in range(_RESAMPLES)]
    low, high = np.quantile(found, [0.025, 0.975])
    return float(low), float(high)


def play(task: Mission, paths: NDArray[np.int64], draws: range) -> NDArray[np.float64]:
    """Returns of paths (k, steps) with draws of the noise: at the last sample, before it, (2, k, m)."""
    environment = task.environment()
    found = np.empty((2, len(paths), len(draws)))
    for p, path in enumerate(paths):
        for d, draw in enumerate(draws):
            environment.np_random = stream(SEED, "diagnosis sensor", draw)
            environment.reset()
            environment.known = environment.known[:0]
            rewards = [environment.step(action)[1] for action in path]
            found[:, p, d] = rewards[-1], sum(rewards[:-1])
    return found


def any_paths(task: Mission, count: int) -> NDArray[np.int64]:
    """Paths (count, steps): of actions drawn one by one or, every other, kept for a while."""
    rng, actions = stream(SEED, "diagnosis paths"), len(task.vehicle.actions)
    drawn = rng.integers(actions, size=(count, task.steps))
    stays = rng.random((count, task.steps)) < _STAYS
    stays[::2], stays[:, 0] = False, False
    for step in range(1, task.steps):
        drawn[:, step] = np.where(stays[:, step], drawn[:, step - 1], drawn[:, step])
    return drawn


def places(task: Mission, paths: NDArray[np.int64]) -> NDArray[np.float64]:
    """Where paths (k, steps) lead, (k, steps, 2) [length]."""
    truth = task.water.truth()
    theta = np.array(task.water.parameters.true)
    found = np.empty((*paths.shape, 2))
    for p, path in enumerate(paths):
        state = task.vehicle.initial()
        for step, action in enumerate(path):
            time = step * task.vehicle.time_step
            state = task.vehicle.step(state, int(action), time, truth.flow, theta, task.water.domain)
            found[p, step] = state[:2]
    return found


def best(task: Mission, paths: NDArray[np.int64], rounds: tuple[tuple[int, int], ...]) -> NDArray[np.int64]:
    """The path (steps,) of greatest mean return: in each round, with new noise, the best ones stay.

    Args:
        task: the mission.
        paths: to choose from, (k, steps).
        rounds: how many draws of noise, and how many paths stay after them.
    """
    first = 0
    for draws, stay in rounds:
        means = play(task, paths, range(first, first + draws)).sum(axis=0).mean(axis=1)
        paths, first = paths[np.argsort(-means, kind="stable")[:stay]], first + draws
    return paths[0]


def chosen(task: Mission, count: int, rounds: tuple[tuple[int, int], ...]) -> dict[str, NDArray[np.int64]]:
    """Paths (steps,) by name: the best of ``count``, the nearest to the feature, the farthest, drifting."""
    paths = any_paths(task, count)
    far = distances(task, places(task, paths))
    return {
        "best of the paths drawn": best(task, paths, rounds),
        "nearest to the feature": paths[np.argmin(far)],
        "farthest from it": paths[np.argmax(far)],
        "engine off": np.full(task.steps, len(task.vehicle.actions) - 1),
    }
