"""The estimate from samples that somebody has taken: no vehicle, no truth.

Its record is that of a run with one replicate and one episode, whose steps are the samples; only the last
step has errors and estimate, for they follow from all samples together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core.domain import Domain, Grid
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import Errors, Fit, FitProblem, ForwardModel, errors
from fieldrl.loss.squared import Squared
from fieldrl.mission.environment import Estimator
from fieldrl.mission.record import EpisodeLog, described
from fieldrl.mission.robust_residuals import Loss, plain_squares, robust_residuals
from fieldrl.mission.uncertainty_record import SOLVES, estimate_variables, field_uncertainty
from fieldrl.mission.world import even_grid, field_of, world
from fieldrl.uncertainty import Assessment, Noise, assess, noise_of, verdict
from fieldrl.uncertainty.design import information_of

_LISTED = 8  # outliers that are named
_MARGIN = 0.1  # of the samples' extent around them, where the model has no domain


@dataclass(frozen=True, eq=False)
class Estimate:
    """What samples say of a model's unknowns.

    Args:
        model: the forward model.
        samples: n samples.
        fit: of all samples, and of all but each one.
        errors: e_f, e_cv, e_total of it.
        assessment: standard deviations, intervals, what is identified.
        left_out: how many rows were not used, by reason.
        scale: the noise by a robust loss, None with the squared one [field unit].
        outliers: numbers of the samples that a robust loss finds far off.
    """

    model: ForwardModel
    samples: Samples
    fit: Fit
    errors: Errors
    assessment: Assessment
    left_out: Mapping[str, int] = field(default_factory=dict)
    scale: float | None = None
    outliers: tuple[int, ...] = ()

    @property
    def theta(self) -> NDArray[np.float64]:
        """The estimate, (p,)."""
        return self.fit.theta[0]

    @property
    def parameters(self) -> dict[str, float]:
        """The estimate by name."""
        return dict(zip(self.model.parameters.names, self.theta.tolist(), strict=True))

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation by name; infinite where nothing is told."""
        return dict(zip(self.parameters, self.assessment.std.tolist(), strict=True))

    @property
    def identified(self) -> dict[str, bool]:
        """Whether the samples tell it, by name."""
        return dict(zip(self.parameters, self.assessment.identified.tolist(), strict=True))

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % interval by name."""
        ends = self.assessment.interval.tolist()
        return {name: (low, high) for name, (low, high) in zip(self.parameters, ends, strict=True)}

    @property
    def noise(self) -> float:
        """Standard deviation of the noise, root mean square over the samples: as stated, else estimated."""
        return self.scale or float(np.sqrt(np.mean(self.assessment.noise**2)))

    @property
    def noise_stated(self) -> bool:
        """Whether the samples say what their noise is."""
        return self.samples.std is not None

    @property
    def verdict(self) -> str:
        """What the samples tell and what not, in words."""
        return " ".join([*self._doubts(), verdict(self.assessment)])

    def _doubts(self) -> list[str]:
        """That the model does not explain the samples, or some of them."""
        said = []
        if self.outliers:
            listed = ", ".join(str(i + 1) for i in self.outliers[:_LISTED])
            listed += ", ..." if len(self.outliers) > _LISTED else ""
            said.append(f"Far off, and of little weight: sample{'s' * (len(self.outliers) > 1)} {listed}.")
        keep = np.setdiff1d(np.arange(len(self.samples)), self.outliers)
        variance = float(np.var(self.samples.values[keep]))
        share = 1 - float(np.mean(self.fit.residuals[0][keep] ** 2)) / variance if variance else 1.0
        if share < 0.5:
            what = f"The model explains {max(0.0, 100 * share):.0f} % of the variance of the values"
            said.append(f"{what}; do model, units and origin fit, and is no value far off (loss=student_t)?")
        return said

    @property
    def record(self) -> xr.Dataset:
        """What figures and files are made of, see ``estimate_record``."""
        return estimate_record(self)

    def field(self, time: float, grid: Grid) -> NDArray[np.float64]:
        """The estimated field, (nx, ny) [field unit]; by predictions where the model gives no fields."""
        return field_of(self.model, self.theta, time, grid)

    def __str__(self) -> str:
        units = self.model.parameters.units
        lines = [
            f"{name} = {value:.5g} [{low:.5g}, {high:.5g}] {unit}"
            for (name, value), (low, high), unit in zip(
                self.parameters.items(), self.intervals.values(), units, strict=True
            )
        ]
        found = self.errors
        lines.append(f"e_f = {found.e_f:.4g}, e_cv = {found.e_cv:.4g}, noise = {self.noise:.3g}")
        lost = "".join(f"; {count} left out: {reason}" for reason, count in self.left_out.items())
        return "\n".join([*lines, f"{len(self.samples)} samples{lost}", self.verdict])


def estimate(
    samples: Samples,
    model: ForwardModel,
    estimator: Estimator,
    loss: Loss = Squared(),  # noqa: B008
) -> Estimate:
    """Fit a model's unknowns to samples, all folds, and say how far the estimate may be trusted.

    Args:
        samples: n samples, at least one.
        model: the forward model; its true values are not looked at.
        estimator: what fits.
        loss: of a residual, see fieldrl.loss; e_f and e_cv are mean squares whatever it is.

    Raises:
        SolveFailed: where no solve succeeded.
    """
    known = np.empty((0, len(model.parameters)))
    if plain_squares(samples, loss):
        problem = FitProblem(model, samples, estimator.tikhonov, True, known)
        fit = estimator.fit(problem)
        return Estimate(model, samples, fit, errors(fit), _assessed(problem, fit, noise_of(samples, None)))
    made, known = robust_residuals(samples, model, estimator, loss)
    problem = made.problem(estimator, True, known)
    roots = estimator.fit(problem)
    noise = Noise(np.full(len(samples), made.scale), samples.std is not None or loss.robust)
    fit, assessment = made.plain(roots), _assessed(problem, roots, noise)
    found = Estimate(model, samples, fit, errors(fit), assessment)
    if not loss.robust:
        return found
    untested = replace(assessment.misfit, p_large=np.nan, p_small=np.nan, p_outlier=np.nan)
    assessment = replace(assessment, misfit=untested)
    outliers = tuple(made.outliers(fit).tolist())
    return replace(found, assessment=assessment, scale=made.scale, outliers=outliers)


def _assessed(problem: FitProblem, fit: Fit, noise: Noise) -> Assessment:
    """How far the fit of all samples may be trusted."""
    solved = np.vstack([fit.theta[:1], fit.known]) if len(fit.known) else fit.theta[:1]
    return assess(replace(problem, leave_one_out=False), fit.theta[0], noise, solved, SOLVES)


def estimate_record(found: Estimate) -> xr.Dataset:
    """The record of an estimate: one replicate, one episode, a step for each sample."""
    samples, fit, p = found.samples, found.fit, len(found.model.parameters)
    log = EpisodeLog(1, len(samples), p)
    values, last = log.values, (0, -1)
    values["position"][0] = values["measured_position"][0] = samples.positions
    values["time"][0], values["value"][0] = samples.times, samples.values
    values["theta"][last], values["evaluations"][last] = found.theta, fit.evaluations
    values["e_f"][last], values["e_cv"][last], values["e_total"][last] = found.errors
    if fit.course is not None and len(fit.course.loss):
        log.courses[0, len(samples) - 1] = fit.course
    record = xr.merge([log.dataset(), EpisodeLog(0, len(samples), p).dataset("evaluation_")], join="outer")
    record["return"] = ("episode",), [np.nan], record["return"].attrs
    grid, time = _grid(found.model, samples), float(samples.times.max())
    record = record.assign(_of_samples(found) | _of_the_estimate(found, grid, time))
    record = record.expand_dims("replicate")
    domain, noise = domain_of(found.model, samples), found.noise
    unknown = np.full((grid.x.size, grid.y.size), np.nan)
    start = samples.positions[np.argmin(samples.times)]
    record = described(record, found.model.parameters, grid, unknown, start, domain, noise)
    record["true"].values[:] = np.nan
    return record.assign_attrs(kind="estimate", field_time=time)


def _of_samples(found: Estimate) -> dict[str, Any]:
    """Record variables by sample: residuals, the estimate without each, what is stated of the noise."""
    samples, fit = found.samples, found.fit
    left_out = np.diagonal(fit.residuals[1:]).copy()
    std = np.full(len(samples), np.nan) if samples.std is None else samples.std
    below = np.zeros(len(samples)) if samples.censored is None else samples.censored
    return {
        name: (("episode", "step", *more), values[None], {"units": unit, "long_name": text})
        for name, more, values, unit, text in (
            ("std", (), std, "field unit", "stated standard deviation of the value's noise"),
            ("censored", (), below.astype(float), "1", "1 where the value is a detection limit"),
            ("residual", (), fit.residuals[0], "field unit", "prediction minus value"),
            ("residual_left_out", (), left_out, "field unit", "prediction without the sample, minus value"),
            (
                "theta_left_out", ("parameter",), fit.theta[1:],
                "see parameter_unit", "estimate without the sample",
            ),
        )
    }  # fmt: skip


def _of_the_estimate(found: Estimate, grid: Grid, time: float) -> dict[str, Any]:
    """Record variables of the whole."""
    estimated = found.field(time, grid)
    variables = {
        "pooled": (
            ("parameter",), found.theta,
            {"units": "see parameter_unit", "long_name": "estimate from all samples"},
        ),
        "best_episode": ((), 0, {"units": "1", "long_name": "episode of least total error"}),
        "forward_solves": (
            ("episode",),
            [found.fit.evaluations],
            {"units": "1", "long_name": "forward evaluations of an episode's fits"},
        ),
        "field_estimate": (
            ("x", "y"), estimated,
            {"units": "field unit", "long_name": "estimated field at the final time"},
        ),
        "information": (
            ("parameter", "with_parameter"), information_of(found.assessment.axes),
            {"units": "1", "long_name": "Fisher information of the unknowns in half-widths of their bounds"},
        ),
        "verdict": ((), found.verdict, {"units": "1", "long_name": "what all samples tell, in words"}),
    }  # fmt: skip
    for name, text in (("pooled", "all samples' estimate"), ("best", "all samples' estimate")):
        variables |= estimate_variables(found.assessment, name, text)
    return variables | field_uncertainty(world(found.model), found.assessment, time, estimated, grid)


def domain_of(model: Any, samples: Samples) -> Domain:
    """The model's, else a rectangle around the samples."""
    if hasattr(model, "domain"):
        return model.domain
    low, high = samples.positions.min(axis=0), samples.positions.max(axis=0)
    margin = np.maximum(_MARGIN * (high - low).max(), 1e-9)
    return Domain(tuple(low - margin), tuple(high + margin))


def _grid(model: Any, samples: Samples) -> Grid:
    """The model's own, else about a hundred cells along the longer side of the domain."""
    return model.grid if hasattr(model, "grid") else even_grid(domain_of(model, samples))
