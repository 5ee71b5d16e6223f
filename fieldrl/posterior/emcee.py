"""``posterior=emcee``: the affine-invariant ensemble sampler of Goodman and Weare (2010).

emcee (Foreman-Mackey et al. 2013) is an extra: ``pip install 'fieldrl[posterior]'``. It needs NumPy alone, no
derivatives and no tuning, asks for many points at once, and does not mind narrow, oblique valleys, which few
samples leave.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.core.kinds import component


@component
class Emcee:
    """Walkers that step along the lines between them.

    Args:
        walkers: how many, even; each is a chain.
        draws: of each, after the first steps.
        thin: a draw is every so many-th step; steps that follow each other are alike.
        burn_in: the first steps of each, which are left out.
    """

    walkers: int = 32
    draws: int = 500
    thin: int = 5
    burn_in: int = 200

    def __post_init__(self) -> None:
        checks.integer("walkers", self.walkers, 4)
        checks.integer("draws", self.draws, 1)
        checks.integer("thin", self.thin, 1)
        checks.integer("burn_in", self.burn_in, 0)
        if self.walkers % 2:
            raise InvalidValue("walkers", self.walkers, "must be even")
        if find_spec("emcee") is None:
            raise FieldrlError("posterior=emcee needs an extra: pip install 'fieldrl[posterior]'")

    def sample(
        self, log_density: Callable[[NDArray], NDArray], starts: NDArray[np.float64], seed: int
    ) -> NDArray[np.float64]:
        """Draws from a density within the box |u| <= 1.

        Args:
            log_density: of points u (m, p) of the box, (m,), up to a constant.
            starts: points of it that are likely, (k, p), k at least the number of walkers.
            seed: of the walk.

        Returns:
            (walkers, draws, p).

        Raises:
            InvalidValue: fewer than two walkers for each unknown.
        """
        if self.walkers < 2 * starts.shape[1]:
            raise InvalidValue(
                "walkers", self.walkers, f"must be >= {2 * starts.shape[1]}, two for each unknown"
            )
        from emcee import EnsembleSampler  # pyright: ignore[reportAttributeAccessIssue]

        def within(u: NDArray) -> NDArray[np.float64]:
            inside = np.abs(u).max(axis=1) <= 1.0
            found = np.full(len(u), -np.inf)
            found[inside] = log_density(u[inside])
            return found

        chosen, rng = np.linspace(0, len(starts) - 1, self.walkers).astype(int), np.random.default_rng(seed)
        sampler: Any = EnsembleSampler(self.walkers, starts.shape[1], within, vectorize=True)
        sampler._random.seed(seed)
        begin = np.clip(_apart(starts[chosen], rng), -1.0, 1.0)
        sampler.run_mcmc(begin, self.burn_in + self.draws * self.thin, skip_initial_state_check=True)
        chain = sampler.get_chain(discard=self.burn_in, thin=self.thin)
        return np.ascontiguousarray(chain.transpose(1, 0, 2))


def _apart(starts: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """The starts, shifted by a hundredth of their scatter: equal ones would stay together."""
    return starts + (0.01 * starts.std(axis=0) + 1e-9) * rng.standard_normal(starts.shape)
