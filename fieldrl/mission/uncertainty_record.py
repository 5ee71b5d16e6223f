"""The record's variables of uncertainty: std, interval, identified, residuals, regions, verdict."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.domain import Grid
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import FitProblem
from fieldrl.mission.environment import Water
from fieldrl.mission.mission import Mission, Posterior
from fieldrl.mission.stopping import stated_noise
from fieldrl.uncertainty import Assessment, assess, draws, field_std, noise_of, regions, verdict
from fieldrl.uncertainty.regions import Regions, nowhere

SOLVES = 3
"""So many solves of a dear model, at most, are made for the intervals of a replicate."""

_UNIT = "see parameter_unit"


def uncertainty_variables(
    mission: Mission,
    water: Water,
    values: dict[str, NDArray],
    best: int,
    pooled: NDArray,
    known: NDArray,
    estimate: NDArray,
    grid: Grid,
    seed: int,
) -> dict[str, Any]:
    """Record variables: std, interval, whether identified, of the pooled estimate and the best episode's.

    Args:
        mission: what was done.
        water: of the best episode; of all of them, where the scenario does not vary.
        values: of the learning episodes, (episodes, steps, ...).
        best: number of the best episode.
        pooled: estimate from all samples, (p,); NaN where there is none.
        known: parameters that were solved, (k, p).
        estimate: the best episode's field at the final time, (nx, ny) [field unit].
        grid: of it.
        seed: of draws from the posterior.
    """
    taken = np.isfinite(values["time"])
    every, paths = samples_of(values, taken), np.nonzero(taken)[0]
    residual = np.full(taken.shape, np.nan)
    found: dict[str, Any] = {"pooled_residual": _residual(residual)}
    told, solves, elsewhere = "", SOLVES, None
    one = values["theta"][best, -1]
    for name, text, samples, theta, path in (
        ("pooled", "all samples' estimate", every, pooled, paths),
        ("best", "the best episode's estimate", samples_of(values, best), one, None),
    ):
        if np.isnan(theta).any():
            found |= _nothing(name, text, len(theta))
            if name == "best":
                found |= _field_variable(np.full(estimate.shape, np.nan))
            continue
        problem = FitProblem(water, samples, mission.estimator.tikhonov, False)
        noise = replace(noise_of(samples, stated_noise(mission.vehicle.sensor)), elsewhere=elsewhere)
        solved = np.vstack([theta[None], known]) if len(known) else theta[None]
        result = assess(problem, theta, noise, solved, solves, path)
        solves, told = solves - result.solves, told or verdict(result)
        if not noise.known:
            # the best episode was chosen for its small residuals: they tell too small a noise
            elsewhere = noise.variance(result.least, len(theta)), noise.free(len(theta))
        found |= estimate_variables(result, name, text)
        if name == "best":
            found |= field_uncertainty(water, result, mission.duration, estimate, grid)
        if mission.posterior is not None and (name == "pooled" or "posterior" not in found):
            found |= _posterior(mission.posterior, result, text, seed)
        if name == "pooled":
            residual[taken] = result.residuals
    found["verdict"] = (), told, {"units": "1", "long_name": "what all samples tell, in words"}
    return found


def _posterior(posterior: Posterior, result: Assessment, text: str, seed: int) -> dict[str, Any]:
    """Draws from the posterior of an estimate: uniform within the bounds before there are samples."""
    u = posterior.sample(result.log_likelihood, draws(result), seed)
    theta = result.parameters.centre + result.parameters.half_width * u
    about = {"units": _UNIT, "long_name": f"draws from the posterior of {text}"}
    return {"posterior": (("chain", "draw", "parameter"), theta, about)}


def field_uncertainty(
    water: Any, result: Assessment, time: float, estimate: NDArray, grid: Grid
) -> dict[str, Any]:
    """The record variable of the standard deviation of the estimated field (nx, ny) [field unit]."""
    if not np.isfinite(estimate).any():  # of a model without a field
        return _field_variable(np.full(estimate.shape, np.nan))
    theta = result.parameters.centre + result.parameters.half_width * draws(result)
    return _field_variable(field_std(water, estimate, theta, time, grid, result.solved))


def _field_variable(std: NDArray) -> dict[str, Any]:
    text = (
        "standard deviation of the estimated field at the final time, by the fields that explain the samples"
    )
    return {"field_std": (("x", "y"), std, {"units": "field unit", "long_name": text})}


def estimate_variables(result: Assessment, name: str, text: str) -> dict[str, Any]:
    """Record variables of one assessment.

    Args:
        result: the assessment.
        name: what the variables begin with.
        text: whose they are, in words.
    """
    found = _variables(name, text, result.std, result.interval, result.identified)
    return found | _regions(name, text, regions(result))


def _regions(name: str, text: str, found: Regions) -> dict[str, Any]:
    """Of the joint regions; nothing where there is one unknown."""
    if not len(found.pairs):
        return {}
    about = {
        "pair": (("pair", "of_pair"), found.pairs, "1", "which two unknowns"),
        "first": (("pair", "solution", "along_first"), found.first, _UNIT, "values of the first of a pair"),
        "second": (("pair", "solution", "along_second"), found.second, _UNIT, "values of the other one"),
        "above": (
            ("pair", "solution", "along_first", "along_second"), found.above,
            "1", f"deviance above its least value about each solution of {text}",
        ),
        "rise": (("level",), found.rise, "1", "the same on the edge of the regions of 50 and 95 %"),
        "solutions": (("solution", "parameter"), found.solutions, _UNIT, f"solutions that fit beside {text}"),
    }  # fmt: skip
    return {
        f"{name}_region_{part}": (dims, values, {"units": unit, "long_name": words})
        for part, (dims, values, unit, words) in about.items()
    }


def _nothing(name: str, text: str, p: int) -> dict[str, Any]:
    """Of an estimate that there is none of."""
    found = _variables(name, text, np.full(p, np.nan), np.full((p, 2), np.nan), np.zeros(p, dtype=bool))
    return found | _regions(name, text, nowhere(p))


def _variables(name: str, text: str, std: NDArray, interval: NDArray, identified: NDArray) -> dict[str, Any]:
    about = {
        "std": f"standard deviation of {text}",
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


def samples_of(values: dict[str, NDArray], at: Any) -> Samples:
    """The samples of some episodes, those that were not taken left out."""
    position, time, value = (values[name][at] for name in ("measured_position", "time", "value"))
    taken = np.isfinite(time)
    return Samples.of(position[taken], time[taken], value[taken])
