"""Runs beside the learner's, paired with it by their noise: agents that learn nothing, and no diffusion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import gyres, variations

AGENTS = {"random": "random", "drift": "drifting", "lawnmower": "lawnmower"}
"""Options of the group ``agent``, and what they are called."""

STILL = "without diffusion"


class Setting(NamedTuple):
    """What a learner is compared in.

    Args:
        name: of the hypothesis.
        learner: its run.
        others: runs of the agents that learn nothing, by what they are called.
    """

    name: str
    learner: Found
    others: dict[str, Found]


def plan(settings: Settings) -> dict[str, Wanted]:
    """A run for each agent and setting, and the gyre's run without diffusion."""
    found = {STILL: Wanted("double_gyre", ("pde.diffusivity=0",))}
    for agent in AGENTS:
        changed = f"agent={agent}"
        found[_name(gyres.RUN, agent)] = Wanted("double_gyre", (changed,))
        for estimator, each in variations.ESTIMATORS.items():
            found[_name(estimator, agent)] = Wanted("advection", (*each.overrides, changed))
    return found


def advection(runs: Mapping[str, Found]) -> list[Setting]:
    """The first experiment with either estimator."""
    return [
        _setting(runs, estimator, each.short, variations.name(estimator, "step_size", 0.9))
        for estimator, each in variations.ESTIMATORS.items()
    ]


def double_gyre(runs: Mapping[str, Found]) -> Setting:
    """The second experiment."""
    return _setting(runs, gyres.RUN, "double gyre", gyres.RUN)


def _setting(runs: Mapping[str, Found], key: str, name: str, learner: str) -> Setting:
    others = {text: runs[_name(key, agent)] for agent, text in AGENTS.items()}
    return Setting(name, runs[learner], others)


def _name(setting: str, agent: str) -> str:
    return f"{setting} agent={agent}"
