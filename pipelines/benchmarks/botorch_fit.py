"""BoTorch's composite expected improvement on a fit problem: a benchmark extra.

    pip install botorch        (brings PyTorch)

As in its tutorial on composite functions (Astudillo & Frazier 2019): independent processes on the
standardised predictions, noisy-free training data, the loss as a Monte-Carlo objective.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from scipy.stats import qmc

from fieldrl.estimator.evaluations import Evaluations
from fieldrl.estimator.problem import Fit, FitProblem


def reason() -> str | None:
    """Why BoTorch cannot be compared, or None."""
    try:
        import botorch  # noqa: F401  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        return f"not installed ({error})"
    return None


def fit(problem: FitProblem, number: int, *, initial: int, budget: int) -> Fit:
    """``budget`` solves, the first ``initial`` of them scrambled Sobol' points, seeded by ``number``."""
    import torch  # pyright: ignore[reportMissingImports]

    parameters, evaluations = problem.model.parameters, Evaluations(problem)
    lower, width = np.array(parameters.lower), 2 * parameters.half_width
    torch.manual_seed(number)
    torch.set_num_threads(1)
    sobol = qmc.Sobol(len(parameters), rng=np.random.default_rng(number))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for unit in sobol.random(initial):
            evaluations.ask(lower + width * unit)
        while evaluations.count < budget:
            unit = (evaluations.theta - lower) / width
            evaluations.ask(lower + width * _propose(problem, unit, evaluations.residuals))
    return evaluations.fit()


def _propose(problem: FitProblem, unit: Any, residuals: Any) -> Any:
    """The maximiser of the expected improvement over the unit box, (p,)."""
    import torch  # pyright: ignore[reportMissingImports]
    from botorch.acquisition.logei import qLogExpectedImprovement  # pyright: ignore[reportMissingImports]
    from botorch.acquisition.objective import GenericMCObjective  # pyright: ignore[reportMissingImports]
    from botorch.fit import fit_gpytorch_mll  # pyright: ignore[reportMissingImports]
    from botorch.models import SingleTaskGP  # pyright: ignore[reportMissingImports]
    from botorch.models.transforms import Standardize  # pyright: ignore[reportMissingImports]
    from botorch.optim import optimize_acqf  # pyright: ignore[reportMissingImports]
    from gpytorch.mlls import ExactMarginalLogLikelihood  # pyright: ignore[reportMissingImports]

    x, y = torch.tensor(unit, dtype=torch.double), torch.tensor(residuals, dtype=torch.double)
    model = SingleTaskGP(
        x, y, torch.full_like(y, 1e-6), outcome_transform=Standardize(y.shape[1], min_stdv=1e-6)
    )
    fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))

    def objective(samples: Any, X: Any = None) -> Any:
        penalty = 0.0 if X is None else problem.tikhonov * ((2 * X - 1) ** 2).sum(-1)
        return -(samples**2).mean(-1) - penalty

    best = objective(y, x).max()
    acquisition = qLogExpectedImprovement(model, best_f=best, objective=GenericMCObjective(objective))
    bounds = torch.tensor([[0.0] * x.shape[1], [1.0] * x.shape[1]], dtype=torch.double)
    found, _ = optimize_acqf(acquisition, bounds, q=1, num_restarts=8, raw_samples=128)
    return found[0].numpy()
