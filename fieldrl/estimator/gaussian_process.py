"""The paper's estimator: Gaussian-process Bayesian optimisation of the scalar misfit, by scikit-optimize.

scikit-optimize stands behind this file alone. It sees a number for each theta: the penalised loss of one
fold, or its logarithm, which is much easier to model (the loss spans five decades).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from threadpoolctl import threadpool_limits

from fieldrl.core import checks
from fieldrl.core.cost import DOUBLE, Cost, Extent, solve_seconds
from fieldrl.core.kinds import component
from fieldrl.core.streams import stream
from fieldrl.estimator.evaluations import Evaluations, at_centre
from fieldrl.estimator.problem import Fit, FitProblem, ForwardModel, Optimisation

SCALES = ("log", "linear")
DESIGNS = ("sobol", "lhs", "hammersly", "halton", "random", "grid")
_SMALLEST = 1e-12  # a loss below this counts as this in a logarithm [field unit^2]


@component
class GaussianProcess:
    """Expected improvement on the misfit of each fold.

    Args:
        scale: what is modelled, "log" (of the loss) or "linear" (the loss).
        budget: solves of one optimisation.
        initial: how many of them are the initial design.
        design: "sobol", "lhs", "hammersly", "halton", "random" or "grid".
        noise: variance of the noise in what is modelled, >= 0, or None: estimated.
        share: false: a separate optimisation for each fold, as in the paper; true: folds and fits start from
            all solves already known, and end when less than ``tolerance`` is expected to be gained.
        tolerance: least expected gain that is worth a solve when sharing, as a share of the loss.
        told: at most so many known solves, the best ones, are told to a fold's optimisation.
        seed: of the initial design and of scikit-optimize's own draws.
        tikhonov: tau >= 0, weight of the pull towards the centre of the bounds [field unit^2].
    """

    scale: str = "log"
    budget: int = 30
    initial: int = 10
    design: str = "sobol"
    noise: float | None = 1e-8
    share: bool = False
    tolerance: float = 0.01
    told: int = 50
    seed: int = 0
    tikhonov: float = 1e-3

    def __post_init__(self) -> None:
        checks.one_of("scale", self.scale, SCALES)
        checks.one_of("design", self.design, DESIGNS)
        for name, least in (("budget", 1), ("initial", 1), ("told", 1), ("seed", 0)):
            checks.integer(name, getattr(self, name), least)
        if self.noise is not None:
            checks.not_negative("noise", self.noise)
        checks.boolean("share", self.share)
        checks.positive("tolerance", self.tolerance)
        checks.not_negative("tikhonov", self.tikhonov, "field unit^2")

    def cost(self, extent: Extent, model: ForwardModel) -> Cost:
        """scikit-optimize's time to model and to propose, and the solves."""
        known = self.budget + (min(self.told, self.budget * extent.samples) if self.share else 0)
        solves = min(self.budget, 3) if self.share else self.budget
        fits = extent.samples * (extent.steps + 3) / 2 + 1
        propose = 0.04 + 2e-3 * known + 2e-8 * known**3
        design = self.initial * (5e-5 + (1e-5 * self.initial if self.design == "lhs" else 0))
        one = solve_seconds(model, extent.steps)
        course = 4 * extent.samples * self.budget * (extent.steps + 1) * (2 + extent.parameters)
        memory = DOUBLE * (20_000 * known + 5 * known**2 + 100 * self.initial + course)
        return Cost(memory, fits * (solves * (propose + one) + design), by=("budget", "initial", "told"))

    def fit(self, problem: FitProblem) -> Fit:
        """Minimisers of every fold among the solves; raises SolveFailed where no solve succeeded."""
        problem = replace(problem, tikhonov=self.tikhonov)
        if not len(problem.samples):
            return at_centre(problem, self.share)
        with _quiet():
            return self._together(problem) if self.share else self._apart(problem)

    def _together(self, problem: FitProblem) -> Fit:
        """One store of evaluations for all folds."""
        evaluations = Evaluations(problem, share=True)
        gains = [_Optimisation(self, problem, evaluations, fold).run() for fold in range(problem.folds)]
        return self._judged(evaluations.fit(), np.array(gains))

    def _apart(self, problem: FitProblem) -> Fit:
        """A store of evaluations for each fold: n + 1 optimisations that know nothing of each other."""
        fits, gains = [], []
        for fold in range(problem.folds):
            evaluations = Evaluations(problem)
            gains.append(_Optimisation(self, problem, evaluations, fold).run())
            fits.append(evaluations.fit())
        courses = [fit.course for fit in fits if fit.course is not None]
        together = Fit(
            theta=np.array([fit.theta[fold] for fold, fit in enumerate(fits)]),
            loss=np.array([fit.loss[fold] for fold, fit in enumerate(fits)]),
            residuals=np.array([fit.residuals[fold] for fold, fit in enumerate(fits)]),
            evaluations=sum(fit.evaluations for fit in fits),
            known=problem.known,
            course=Optimisation(
                np.concatenate([course.theta for course in courses]),
                np.concatenate([course.loss for course in courses]),
            ),
        )
        return self._judged(together, np.array(gains))

    def _judged(self, fit: Fit, gains: NDArray[np.float64]) -> Fit:
        """The fit, with the gain that each fold's model still expects of one more solve, (folds,)."""
        gap = fit.loss * -np.expm1(-gains) if self.scale == "log" else gains
        return replace(fit, gap=gap, converged=gap <= self.tolerance * fit.loss)


class _Optimisation:
    """One fold's optimisation by scikit-optimize."""

    def __init__(
        self, settings: GaussianProcess, problem: FitProblem, evaluations: Evaluations, fold: int
    ) -> None:
        self.settings, self.problem, self.evaluations, self.fold = settings, problem, evaluations, fold
        self.lowest, self.highest = np.inf, -np.inf

    def run(self) -> float:
        """Ask and tell until the budget is spent or, when sharing, little is expected to be gained.

        Returns:
            What one more solve is expected to gain; infinite before there is a model.
        """
        settings, before = self.settings, self.evaluations.count
        known = self._known()
        optimizer = self._optimizer(max(settings.initial - len(known), 0))
        if known:
            optimizer.tell([theta.tolist() for theta, _ in known], [self._told(loss) for _, loss in known])
        for _ in range(settings.budget):
            proposal = [float(x) for x in optimizer.ask()]
            if self.evaluations.count - before >= settings.budget or self._is_idle(optimizer, proposal):
                break
            optimizer.tell(proposal, self._told(self._loss(np.array(proposal))))
        return self._expected_gain(optimizer, [float(x) for x in optimizer.ask()])

    def _known(self) -> list[tuple[NDArray, float]]:
        """The best solves that the evaluations hold for this fold, with their losses."""
        theta, residuals = self.evaluations.theta, self.evaluations.residuals
        if not len(theta):
            return []
        losses = self.problem.losses(residuals, theta)[:, self.fold]
        order = np.argsort(losses, kind="stable")[: self.settings.told]
        return [(theta[i], float(losses[i])) for i in np.sort(order)]

    def _optimizer(self, initial: int) -> Any:
        from skopt import Optimizer
        from skopt.space import Space
        from skopt.utils import cook_estimator, normalize_dimensions

        parameters, n = self.problem.model.parameters, len(self.problem.samples)
        bounds = list(zip(parameters.lower, parameters.upper, strict=True))
        space: Any = normalize_dimensions(Space(bounds).dimensions)
        noise = "gaussian" if self.settings.noise is None else max(self.settings.noise, 1e-10)
        rng = stream(self.settings.seed, "gaussian process", n, self.fold, self.evaluations.opening)
        seed = int(rng.integers(2**31 - 1))
        estimator: Any = cook_estimator("GP", space=space, random_state=seed, noise=noise)
        return Optimizer(
            space,
            estimator,
            n_initial_points=initial,
            initial_point_generator=self.settings.design,
            acq_func="EI",
            random_state=seed,
        )

    def _loss(self, theta: NDArray) -> float:
        residuals = self.evaluations.ask(theta)
        if residuals is None:
            return np.inf
        return float(self.problem.losses(residuals[None], theta[None])[0, self.fold])

    def _told(self, loss: float) -> float:
        """What scikit-optimize is told; for a failed solve the worst so far, for it refuses infinity."""
        if not np.isfinite(loss):
            return self.highest if np.isfinite(self.highest) else 0.0
        value = float(np.log(max(loss, _SMALLEST))) if self.settings.scale == "log" else loss
        self.lowest, self.highest = min(self.lowest, value), max(self.highest, value)
        return value

    def _is_idle(self, optimizer: Any, proposal: list[float]) -> bool:
        """Whether, when sharing, the proposal is expected to gain less than is worth a solve."""
        if not self.settings.share:
            return False
        scale = 1.0 if self.settings.scale == "log" else max(self.lowest, _SMALLEST)
        return self._expected_gain(optimizer, proposal) < self.settings.tolerance * scale

    def _expected_gain(self, optimizer: Any, proposal: list[float]) -> float:
        """Expected improvement of what is modelled at the proposal; infinite before there is a model."""
        if not optimizer.models:
            return np.inf
        where = optimizer.space.transform([proposal])
        mean, deviation = (float(x[0]) for x in optimizer.models[-1].predict(where, return_std=True))
        if deviation <= 0.0:
            return 0.0
        z = (self.lowest - mean) / deviation
        return deviation * float(z * norm.cdf(z) + norm.pdf(z))


@contextmanager
def _quiet() -> Iterator[None]:
    """One BLAS thread, and no warnings from libraries about points seen before or kernels at their bounds."""
    with threadpool_limits(limits=1), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
