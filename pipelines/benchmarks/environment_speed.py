"""Steps a second: one environment, Gymnasium's loop over many, and ours of many at once.

python -m pipelines.benchmarks.environment_speed            the whole
python -m pipelines.benchmarks.environment_speed small      seconds, for CI

All of them in one process on one core, in turn, with random actions; a step is one sample of one mission. It
is the processor's time that is measured, which other programs lengthen least; ratios are within a round.

Takes two minutes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from threadpoolctl import threadpool_limits

import fieldrl  # noqa: F401 - registers the environments
from pipelines import report

NAMES = {
    "one": "one environment",
    "sync": "Gymnasium's SyncVectorEnv",
    "ours": "make_vec",
}
SETTINGS = {
    "as shipped, 20 samples": [],
    "as shipped, 10 samples": ["steps=10"],
    "experiment=search": ["experiment=search"],
}


def one(overrides: list[str], count: int, steps: int) -> Callable[[], float]:
    """One environment that takes ``count`` episodes; a round gives seconds a step."""
    environment = gymnasium.make("fieldrl/Advection-v0", overrides=overrides)
    rng = np.random.default_rng(0)

    def episodes() -> float:
        begin = time.thread_time()
        for _ in range(count):
            environment.reset()
            for action in rng.integers(7, size=steps):
                environment.step(action)
        return (time.thread_time() - begin) / (count * steps)

    return episodes


def many(overrides: list[str], count: int, steps: int, **settings: Any) -> Callable[[], float]:
    """``count`` environments that take an episode each; the step in which they begin anew belongs to it."""
    environments = gymnasium.make_vec("fieldrl/Advection-v0", num_envs=count, overrides=overrides, **settings)
    environments.reset(seed=0)
    rng = np.random.default_rng(0)

    def episodes() -> float:
        begin = time.thread_time()
        for _ in range(steps + 1):
            environments.step(rng.integers(7, size=count))
        return (time.thread_time() - begin) / (count * steps)

    return episodes


def measure(overrides: list[str], steps: int, count: int, rounds: int) -> dict[str, list[float]]:
    """Seconds a step in each round, by name."""
    rounds_of = {
        "one": one(overrides, count, steps),
        "sync": many(overrides, count, steps, vectorization_mode="sync"),
        "ours": many(overrides, count, steps),
    }
    for each in rounds_of.values():
        each()  # compiles
    found: dict[str, list[float]] = {name: [] for name in rounds_of}
    for _ in range(rounds):
        for name, each in rounds_of.items():
            found[name].append(each())
    return found


def main(scale: str = "full") -> dict[str, Any]:
    """Measure, print, write outputs/environment_speed.json; returns what was written."""
    count, rounds = (4, 2) if scale == "small" else (64, 5)
    content: dict[str, Any] = {"scale": scale, "environments": count, "seconds": {}}
    rows = []
    with threadpool_limits(1):
        for setting, overrides in SETTINGS.items():
            steps = 10 if "steps=10" in overrides else 20
            seconds = content["seconds"][setting] = measure(overrides, steps, count, rounds)
            for name, measured in seconds.items():
                ratio = np.array(seconds["one"]) / np.array(measured)
                speed = f"{1 / np.median(measured):,.0f}"
                rows.append((f"{setting}: {NAMES[name]}", speed, report.spread(ratio)))
    columns = f"{count} environments", "steps a second", "times one environment"
    report.show("Random actions, one core", columns, rows)
    print(report.markdown(columns, rows))
    report.write("environment_speed", content)
    return content


if __name__ == "__main__":
    main(*sys.argv[1:])
