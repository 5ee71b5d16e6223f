"""What a replicate's record says of how far its estimates may be trusted."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission.environment import Water
from fieldrl.mission.mission import Mission
from fieldrl.uncertainty import Assessment, assess, noise_of, verdict

SOLVES = 3
"""So many solves of a dear model, at most, are made for the intervals of a replicate."""

_UNIT = "see parameter_unit"


def assessed(
    mission: Mission, water: Water, values: dict[str, NDArray], best: int, pooled: NDArray, known: NDArray
) -> dict[str, Any]:
    """Record variables: std, interval and whether identified, of the pooled estimate and the best episode's.

    Args:
        mission: what was done.
        water: of the best episode; of all of them, where the scenario does not vary.
        values: of the learning episodes, (episodes, steps, ...).
        best: number of the best episode.
        pooled: estimate from all samples, (p,); NaN where there is none.
        known: parameters that were solved, (k, p).
    """
    steps = values["time"].shape[1]
    paths = np.repeat(np.arange(len(values["time"])), steps)
    every = _samples(values, slice(None))
    found: dict[str, Any] = {"pooled_residual": _residual(np.full(values["value"].shape, np.nan))}
    told, solves, elsewhere = "", SOLVES, None
    one = values["theta"][best, -1]
    for name, text, samples, theta, path in (
        ("pooled", "all samples' estimate", every, pooled, paths),
        ("best", "the best episode's estimate", _samples(values, best), one, None),
    ):
        if np.isnan(theta).any():
            found |= _nothing(name, text, len(theta))
            continue
        problem = FitProblem(water, samples, mission.estimator.tikhonov, False)
        noise = replace(noise_of(samples, _stated(mission)), elsewhere=elsewhere)
        solved = np.vstack([theta[None], known]) if len(known) else theta[None]
        result = assess(problem, theta, noise, solved, solves, path)
        solves, told = solves - result.solves, told or verdict(result)
        if not noise.known:
            # the best episode was chosen for its small residuals: they tell too small a noise
            elsewhere = noise.variance(result.least, len(theta)), noise.free(len(theta))
        found |= trust_variables(result, name, text)
        if name == "pooled":
            found["pooled_residual"] = _residual(result.residuals.reshape(values["value"].shape))
    found["verdict"] = (), told, {"units": "1", "long_name": "what all samples tell, in words"}
    return found


def trust_variables(result: Assessment, name: str, text: str) -> dict[str, Any]:
    """Record variables of one assessment.

    Args:
        result: the assessment.
        name: what the variables begin with.
        text: whose they are, in words.
    """
    return _variables(name, text, result.std, result.interval, result.identified)


def _nothing(name: str, text: str, p: int) -> dict[str, Any]:
    """Of an estimate that there is none of."""
    return _variables(name, text, np.full(p, np.nan), np.full((p, 2), np.nan), np.zeros(p, dtype=bool))


def _variables(name: str, text: str, std: NDArray, interval: NDArray, identified: NDArray) -> dict[str, Any]:
    about = {
        "std": f"standard deviation of {text}, by Fisher information",
        "interval": f"95 % profile-likelihood interval of {text}",
    }
    told = {part: {"units": _UNIT, "long_name": words} for part, words in about.items()}
    whether = {"units": "1", "long_name": f"1 where {text} is identified"}
    return {
        f"{name}_std": (("parameter",), std, told["std"]),
        f"{name}_interval": (("parameter", "end"), interval, told["interval"]),
        f"{name}_identified": (("parameter",), identified.astype(np.int8), whether),
    }


def _residual(residual: NDArray) -> tuple[tuple[str, str], NDArray, dict[str, str]]:
    text = "prediction minus value at the estimate from all samples"
    return ("episode", "step"), residual, {"units": "field unit", "long_name": text}


def _samples(values: dict[str, NDArray], at: Any) -> Samples:
    return Samples.of(values["measured_position"][at], values["time"][at], values["value"][at])


def _stated(mission: Mission) -> float | None:
    """The sensor's noise; not known where positions are measured with noise as well."""
    sensor = mission.vehicle.sensor
    return None if any(getattr(sensor, "covariance", ())) else sensor.noise
