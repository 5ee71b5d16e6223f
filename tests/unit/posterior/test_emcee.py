"""Draws from the posterior against a posterior on a grid."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import logsumexp

from fieldrl.core.checks import InvalidValue
from fieldrl.posterior.emcee import Emcee
from fieldrl.uncertainty import Noise, assess, draws
from tests.unit.uncertainty.fit_problems import line, plume

PROBLEMS = {
    "curved": (plume(3, seed=2, noise=5.0), 5.0, True),
    "two solutions": (line(4, noise=0.8, squared=True, reach=4.0), 0.8, True),
    "noise estimated": (plume(7, seed=2, noise=5.0), 5.0, False),
}


def on_a_grid(log_density, size=801):
    """Marginal distributions of two unknowns by quadrature: ends of cells, cumulated shares (2, size)."""
    axis = np.linspace(-1, 1, size)
    u = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    log = log_density(u)
    share = np.exp(log - logsumexp(log)).reshape(size, size)
    return axis + (axis[1] - axis[0]) / 2, np.cumsum([share.sum(axis=1), share.sum(axis=0)], axis=1)


@pytest.mark.parametrize("name", PROBLEMS)
def test_draws_are_distributed_as_the_posterior_on_a_grid(name):
    problem, noise, known = PROBLEMS[name]
    found = assess(problem, np.array([1.0, 1.0]), Noise(np.full(len(problem.samples), noise), known))
    chain = Emcee(walkers=40, draws=400).sample(found.log_likelihood, draws(found), 1)
    assert chain.shape == (40, 400, 2)
    axis, expected = on_a_grid(found.log_likelihood)
    for k in range(2):
        drawn = np.searchsorted(np.sort(chain[:, :, k], axis=None), axis, side="right") / 16000
        assert np.abs(drawn - expected[k]).max() < 0.06


def test_the_same_seed_gives_the_same_draws_and_another_others():
    problem, noise, known = PROBLEMS["curved"]
    found = assess(problem, np.array([5.0, 5.0]), Noise(np.full(len(problem.samples), noise), known))
    sampler = Emcee(walkers=6, draws=5, burn_in=2)
    one, again, other = (sampler.sample(found.log_likelihood, draws(found), seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other)
    assert np.abs(one).max() <= 1.0


def test_walkers_come_in_pairs_and_two_for_each_unknown():
    with pytest.raises(InvalidValue, match="even"):
        Emcee(walkers=5)
    with pytest.raises(InvalidValue, match="two for each unknown"):
        Emcee(walkers=4).sample(np.ones, np.zeros((10, 3)), 0)
