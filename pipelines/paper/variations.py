"""The runs of figures 3 and 4: step size, trace decay and epsilon, one varied at a time, with two estimators.

The paper's figures are not in its text, and the text does not give the values that were varied: the extremes
here are ours. What is not varied stays as in table 2 of the paper: alpha = 0.9, lambda = 0.9, epsilon = 0.15.
"""

from __future__ import annotations

from typing import NamedTuple

from pipelines.experiments import Settings, Wanted


class Estimator(NamedTuple):
    """How the fits are made."""

    title: str
    short: str
    overrides: tuple[str, ...]


class Parameter(NamedTuple):
    """A parameter that is varied, its symbol and the values that it takes."""

    symbol: str
    text: str
    values: tuple[float, ...]
    usual: float


ESTIMATORS = {
    "single_start": Estimator("every fit from one start", "one start", ("estimator.starts=1",)),
    "global": Estimator("every fit at its global minimum", "global fits", ()),
}
PARAMETERS = {
    "step_size": Parameter("$\\alpha$", "step size alpha", (0.1, 0.5, 0.9), 0.9),
    "trace_decay": Parameter("$\\lambda$", "trace decay lambda", (0.1, 0.5, 0.9), 0.9),
    "exploration": Parameter("$\\epsilon$", "epsilon", (0.05, 0.15, 0.3), 0.15),
}


def values(parameter: str, settings: Settings) -> tuple[float, ...]:
    """What the parameter is set to; at the small scale the usual value and the one farthest from it."""
    every, usual = PARAMETERS[parameter].values, PARAMETERS[parameter].usual
    return tuple(sorted({usual, max(every, key=lambda v: abs(v - usual))})) if settings.small else every


def name(estimator: str, parameter: str, value: float) -> str:
    """Of a run among those of ``plan``."""
    return f"{estimator} {parameter}={value:g}"


def plan(settings: Settings, *estimators: str) -> dict[str, Wanted]:
    """The runs of some estimators, all of them where none is named."""
    return {
        name(estimator, parameter, value): wanted(estimator, parameter, value)
        for estimator in estimators or ESTIMATORS
        for parameter in PARAMETERS
        for value in values(parameter, settings)
    }


def compared(settings: Settings) -> dict[str, Wanted]:
    """Of the same runs, those that claims compare: the usual one, the least and the greatest values."""
    return {
        name(estimator, parameter, value): wanted(estimator, parameter, value)
        for estimator in ESTIMATORS
        for parameter, each in PARAMETERS.items()
        for value in (each.usual, min(values(parameter, settings)), max(values(parameter, settings)))
    }


def wanted(estimator: str, parameter: str, value: float) -> Wanted:
    """One of the runs; the usual value is the experiment's own, so all parameters share that run."""
    usual = PARAMETERS[parameter].usual
    changed = () if value == usual else (f"agent.{parameter}={value:g}",)
    return Wanted("advection", (*ESTIMATORS[estimator].overrides, *changed))
