"""What a run leaves: one xarray.Dataset, and its result in a few numbers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core.domain import Domain, Rectangle
from fieldrl.estimator.problem import Optimisation
from fieldrl.mission.mission import Mission

# name: (dimensions after the episode's, unit, long name)
STEP_VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "position": (("step", "axis"), "length", "true position of the sample"),
    "measured_position": (("step", "axis"), "length", "measured position of the sample"),
    "heading": (("step",), "rad", "true heading"),
    "time": (("step",), "time", "time of the sample"),
    "value": (("step",), "field unit", "measured value"),
    "action": (("step",), "1", "action, row of Eq. (12)"),
    "reward": (("step",), "1", "reward"),
    "e_f": (("step",), "field unit^2", "fitting error, Eq. (4)"),
    "e_cv": (("step",), "field unit^2", "cross-validation error, Eq. (6)"),
    "e_total": (("step",), "field unit^2", "total error, Eq. (7)"),
    "theta": (("step", "parameter"), "see parameter_unit", "estimated parameters"),
    "evaluations": (("step",), "1", "forward evaluations of the fits after this sample"),
}


class EpisodeLog:
    """Arrays that the episodes of one kind fill, (episodes, steps, ...)."""

    def __init__(self, episodes: int, steps: int, parameters: int) -> None:
        sizes = {"step": steps, "axis": 2, "parameter": parameters}
        self.values = {
            name: np.full((episodes, *(sizes[dim] for dim in dims)), np.nan)
            for name, (dims, _, _) in STEP_VARIABLES.items()
        }
        for name in ("action", "evaluations"):
            self.values[name] = np.zeros((episodes, steps), dtype=np.int64)
        self.courses: dict[tuple[int, int], Optimisation] = {}

    def write(self, episode: int, step: int, action: int, reward: float, observation, info: dict) -> None:
        """Keep one step."""
        values, at = self.values, (episode, step)
        values["action"][at] = action
        values["reward"][at] = reward
        values["measured_position"][at] = observation[:2]
        for name in (
            "position", "heading", "time", "value", "e_f", "e_cv", "e_total", "theta", "evaluations",
        ):  # fmt: skip
            values[name][at] = info[name]
        if info["course"] is not None and len(info["course"].loss):
            self.courses[at] = info["course"]

    def state(self) -> dict[str, Any]:
        """The arrays and, one after the other, the courses of the fits: plain arrays."""
        courses, p = list(self.courses.values()), self.values["theta"].shape[-1]
        return {
            "values": self.values,
            "course_at": np.array(list(self.courses), dtype=np.int64).reshape(-1, 2),
            "course_solves": np.array([len(course.loss) for course in courses], dtype=np.int64),
            "course_theta": np.concatenate([np.empty((0, p)), *(course.theta for course in courses)]),
            "course_loss": np.concatenate([np.empty(0), *(course.loss for course in courses)]),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take what ``state`` gave."""
        self.values = state["values"]
        ends = np.cumsum(state["course_solves"])[:-1]
        parts = np.split(state["course_theta"], ends), np.split(state["course_loss"], ends)
        courses = (Optimisation(theta, loss) for theta, loss in zip(*parts, strict=True))
        self.courses = dict(zip(((int(e), int(s)) for e, s in state["course_at"]), courses, strict=False))

    def dataset(self, prefix: str = "") -> xr.Dataset:
        """The arrays with names, units and dimensions; ``prefix`` before each name and the episode."""
        episode = f"{prefix}episode"
        variables = {
            f"{prefix}{name}": ((episode, *dims), self.values[name], {"units": unit, "long_name": text})
            for name, (dims, unit, text) in STEP_VARIABLES.items()
        }
        total = self.values["reward"].sum(axis=1)
        variables[f"{prefix}return"] = (
            (episode,), total, {"units": "1", "long_name": "return, sum of the rewards"},
        )  # fmt: skip
        return xr.Dataset(variables | self._traces(episode, prefix))

    def _traces(self, episode: str, prefix: str) -> dict[str, Any]:
        """The course of every fit, padded with NaN to the longest; nothing where no estimator told any."""
        if not self.courses:
            return {}
        episodes, steps, p = self.values["theta"].shape
        longest = max(len(course.loss) for course in self.courses.values())
        loss = np.full((episodes, steps, longest), np.nan)
        best, theta = loss.copy(), np.full((episodes, steps, longest, p), np.nan)
        for at, course in self.courses.items():
            k = len(course.loss)
            loss[at][:k], best[at][:k], theta[at][:k] = course.loss, course.best, course.theta
        best[np.isinf(best)] = np.nan
        dims, units = (episode, "step", "solve"), {"units": "field unit^2"}
        return {
            "solve": ("solve", np.arange(longest), {"units": "1", "long_name": "solves of the fit so far"}),
            f"{prefix}trace_loss": (dims, loss, units | {"long_name": "loss of each solve of a fit"}),
            f"{prefix}trace_best": (dims, best, units | {"long_name": "least loss so far in a fit"}),
            f"{prefix}trace_theta": (
                (*dims, "parameter"), theta, {"units": "see parameter_unit", "long_name": "what was solved"},
            ),
        }  # fmt: skip


def replicate_record(
    mission: Mission, learning: EpisodeLog, evaluation: EpisodeLog, pooled: NDArray
) -> xr.Dataset:
    """The record of one replicate, without the dimension ``replicate``.

    Args:
        mission: what was done.
        learning: the learning episodes.
        evaluation: the evaluation episodes.
        pooled: estimate from all samples, (p,); NaN where there is none.
    """
    final = learning.values["e_total"][:, -1]
    best = int(np.argmin(np.where(np.isnan(final), np.inf, final)))
    truth = mission.water.truth()
    grid, theta = truth.grid, learning.values["theta"][best, -1]
    estimate = mission.water.field(theta, mission.duration, grid)
    record = xr.merge([learning.dataset(), evaluation.dataset("evaluation_")], join="outer")
    record["pooled"] = (
        ("parameter",), pooled, {"units": "see parameter_unit", "long_name": "estimate from all samples"},
    )  # fmt: skip
    record["best_episode"] = ((), best, {"units": "1", "long_name": "episode of least total error"})
    record["forward_solves"] = (
        ("episode",),
        learning.values["evaluations"].sum(axis=1),
        {"units": "1", "long_name": "forward evaluations of an episode's fits"},
    )
    record["field_estimate"] = (
        ("x", "y"), estimate, {"units": "field unit", "long_name": "estimated field at the final time"},
    )  # fmt: skip
    return record


def combine(replicates: Sequence[xr.Dataset], mission: Mission) -> xr.Dataset:
    """The record of a run from its replicates, with what they have in common.

    Args:
        replicates: their records, in order.
        mission: what was done.
    """
    record = xr.concat(list(replicates), dim="replicate", join="outer")
    parameters, truth = mission.water.parameters, mission.water.truth()
    grid = truth.grid
    field = truth.field(np.array(parameters.true), mission.duration, grid)
    record = record.assign_coords(
        parameter=list(parameters.names),
        axis=["x", "y"],
        x=("x", grid.x, {"units": "length", "long_name": "x"}),
        y=("y", grid.y, {"units": "length", "long_name": "y"}),
    )
    for name, values, text in (
        ("parameter_unit", list(parameters.units), "unit of the parameter"),
        ("lower", list(parameters.lower), "lower bound"),
        ("upper", list(parameters.upper), "upper bound"),
        ("true", list(parameters.true or np.full(len(parameters), np.nan)), "true value"),
    ):
        record[name] = (("parameter",), values, {"units": "see parameter_unit", "long_name": text})
    record["start"] = (("axis",), list(mission.vehicle.start), {"units": "length", "long_name": "start"})
    record["field_true"] = (
        ("x", "y"), field, {"units": "field unit", "long_name": "true field at the final time"},
    )  # fmt: skip
    return record.assign_attrs(_attributes(mission))


def _attributes(mission: Mission) -> dict[str, Any]:
    domain = mission.water.domain
    return {
        "noise": mission.vehicle.sensor.noise,
        "domain_lower": list(domain.lower),
        "domain_upper": list(domain.upper),
        "obstacles": json.dumps(_obstacles(domain)),
        "length_unit": "length",
        "time_unit": "time",
        "field_unit": "field unit",
    }


def _obstacles(domain: Domain) -> list[dict[str, Any]]:
    return [
        {"kind": "rectangle", "lower": list(shape.lower), "upper": list(shape.upper)}
        if isinstance(shape, Rectangle)
        else {"kind": "circle", "centre": list(shape.centre), "radius": shape.radius}
        for shape in domain.obstacles
    ]
