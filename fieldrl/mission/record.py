"""What a run leaves: one xarray.Dataset, and its result in a few numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core.domain import Domain, Grid, Rectangle
from fieldrl.core.parameters import Parameters
from fieldrl.estimator.problem import Optimisation
from fieldrl.mission.environment import FieldSampling, Water
from fieldrl.mission.field_course import field_course
from fieldrl.mission.mission import Mission
from fieldrl.mission.uncertainty_record import uncertainty_variables

# name: (dimensions after the episode's, unit, long name)
STEP_VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "position": (("step", "axis"), "length", "true position of the sample"),
    "measured_position": (("step", "axis"), "length", "measured position of the sample, as fitted"),
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
    "converged": (("step",), "1", "share of the fits after this sample that converged"),
}

EPISODE_VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "truth": (("parameter",), "see parameter_unit", "true parameters of the episode"),
    "place": (("axis",), "length", "centre of the initial feature of the episode"),
}
"""Of a scenario that varies."""


class EpisodeLog:
    """Arrays that the episodes of one kind fill, (episodes, steps, ...), and the truth of each."""

    def __init__(self, episodes: int, steps: int, parameters: int) -> None:
        sizes = {"step": steps, "axis": 2, "parameter": parameters}
        self.values = {
            name: np.full((episodes, *(sizes[dim] for dim in dims)), np.nan)
            for name, (dims, _, _) in (STEP_VARIABLES | EPISODE_VARIABLES).items()
        }
        for name in ("action", "evaluations"):
            self.values[name] = np.zeros((episodes, steps), dtype=np.int64)
        self.courses: dict[tuple[int, int], Optimisation] = {}

    def begin(self, episode: int, environment: FieldSampling) -> None:
        """Keep the truth of an episode that begins."""
        self.values["truth"][episode] = environment.theta
        self.values["place"][episode] = environment.place

    def write(self, episode: int, step: int, action: int, reward: float, info: dict) -> None:
        """Keep one step."""
        values, at = self.values, (episode, step)
        values["action"][at] = action
        values["reward"][at] = reward
        for name in (
            "position", "measured_position", "heading", "time", "value",
            "e_f", "e_cv", "e_total", "theta", "evaluations", "converged",
        ):  # fmt: skip
            values[name][at] = info[name]
        if info["course"] is not None and len(info["course"].loss):
            self.courses[at] = info["course"]

    def end(self, episode: int, last: int) -> None:
        """Fill what an episode leaves that ended with step ``last``: the estimate and its errors stay."""
        rest = slice(last + 1, None)
        for name in ("e_f", "e_cv", "e_total", "theta"):
            self.values[name][episode, rest] = self.values[name][episode, last]
        self.values["reward"][episode, rest] = 0.0
        self.values["action"][episode, rest] = -1

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

    def dataset(self, prefix: str = "", truths: bool = False, used: bool = False) -> xr.Dataset:
        """The arrays with names, units and dimensions; ``prefix`` before each name and the episode.

        Args:
            prefix: of every name.
            truths: with the truth of each episode.
            used: with the number of samples that each episode took.
        """
        episode = f"{prefix}episode"
        kept = STEP_VARIABLES | EPISODE_VARIABLES if truths else STEP_VARIABLES
        variables = {
            f"{prefix}{name}": ((episode, *dims), self.values[name], {"units": unit, "long_name": text})
            for name, (dims, unit, text) in kept.items()
        }
        total = self.values["reward"].sum(axis=1)
        variables[f"{prefix}return"] = (
            (episode,), total, {"units": "1", "long_name": "return, sum of the rewards"},
        )  # fmt: skip
        if used:
            taken = np.isfinite(self.values["time"]).sum(axis=1)
            about = {"units": "1", "long_name": "samples until the episode ended"}
            variables[f"{prefix}samples_used"] = (episode,), taken, about
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
    mission: Mission,
    learning: EpisodeLog,
    evaluation: EpisodeLog,
    pooled: NDArray,
    known: NDArray,
    water_of: Callable[[int], Water],
    seed: int,
) -> xr.Dataset:
    """The record of one replicate, without the dimension ``replicate``.

    Args:
        mission: what was done.
        learning: the learning episodes.
        evaluation: the evaluation episodes.
        pooled: estimate from all samples, (p,); NaN where there is none.
        known: parameters that were solved, (k, p).
        water_of: the water of a learning episode.
        seed: of draws from the posterior.
    """
    final = learning.values["e_total"][:, -1]
    best = int(np.argmin(np.where(np.isnan(final), np.inf, final)))
    water, varies = water_of(best), mission.scenario.varies
    grid, theta = water.truth().grid, learning.values["theta"][best, -1]
    estimate = water.field(theta, mission.duration, grid)
    kept = varies, mission.stop is not None
    episodes = learning.dataset("", *kept), evaluation.dataset("evaluation_", *kept)
    record = xr.merge(episodes, join="outer")
    record["pooled"] = (
        ("parameter",), pooled, {"units": "see parameter_unit", "long_name": "estimate from all samples"},
    )  # fmt: skip
    record = record.assign(
        uncertainty_variables(mission, water, learning.values, best, pooled, known, estimate, grid, seed)
    )
    record["best_episode"] = ((), best, {"units": "1", "long_name": "episode of least total error"})
    record["forward_solves"] = (
        ("episode",),
        learning.values["evaluations"].sum(axis=1),
        {"units": "1", "long_name": "forward evaluations of an episode's fits"},
    )
    record["field_estimate"] = (
        ("x", "y"), estimate, {"units": "field unit", "long_name": "estimated field at the final time"},
    )  # fmt: skip
    if varies:
        record["field_true"] = _as_true_field(_true_field(water, mission.duration))
    return record


def _true_field(water: Water, time: float) -> NDArray[np.float64]:
    truth = water.truth()
    return truth.field(np.array(water.parameters.true), time, truth.grid)


def _as_true_field(field: NDArray) -> tuple[tuple[str, str], NDArray, dict[str, str]]:
    return ("x", "y"), field, {"units": "field unit", "long_name": "true field at the final time"}


def combine(replicates: Sequence[xr.Dataset], mission: Mission) -> xr.Dataset:
    """The record of a run from its replicates, with what they have in common.

    Args:
        replicates: their records, in order.
        mission: what was done.
    """
    record = xr.concat(list(replicates), dim="replicate", join="outer")
    parameters, grid = mission.water.parameters, mission.water.truth().grid
    start, noise = np.array(mission.vehicle.start), mission.vehicle.sensor.noise
    field = None if mission.scenario.varies else _true_field(mission.water, mission.duration)
    record = described(record, parameters, grid, field, start, mission.water.domain, noise)
    if mission.scenario.varies:
        record["true"] = record["true"] * np.nan  # there is one for each episode: the variable truth
        return record
    if not np.isfinite(record["field_true"]).any():  # of a model without a field
        return record
    times = np.array([(step + 1) * mission.vehicle.time_step for step in range(mission.steps)])
    return record.assign(field_course(mission.water.truth(), np.array(parameters.true), times))


def described(
    record: xr.Dataset,
    parameters: Parameters,
    grid: Grid,
    field: NDArray | None,
    start: NDArray,
    domain: Domain,
    noise: float,
) -> xr.Dataset:
    """A record with what its replicates have in common.

    Args:
        record: of all replicates.
        parameters: the unknowns.
        grid: of the fields.
        field: the true field at the final time, (nx, ny) [field unit]; None: each replicate has its own.
        start: where paths begin, (2,) [length].
        domain: the water.
        noise: standard deviation of a sample's noise [field unit].
    """
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
        ("true", list(parameters.true), "true value"),
    ):
        record[name] = (("parameter",), values, {"units": "see parameter_unit", "long_name": text})
    record["start"] = (("axis",), list(start), {"units": "length", "long_name": "start"})
    if field is not None:
        record["field_true"] = _as_true_field(field)
    return record.assign_attrs(_attributes(domain, noise))


def _attributes(domain: Domain, noise: float) -> dict[str, Any]:
    return {
        "noise": noise,
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
