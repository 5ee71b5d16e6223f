"""Joint regions of pairs of unknowns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from fieldrl.uncertainty import assess, noise_of, regions
from tests.unit.uncertainty.fit_problems import line, plume
from tests.unit.uncertainty.test_assessment import linear_answer


@pytest.mark.parametrize("n", [12, 400], ids=["every sample", "quadratic"])
def test_the_region_of_a_linear_model_is_its_ellipse(n):
    problem = line(n, noise=0.3)
    theta, covariance, _ = linear_answer(problem)
    found = regions(assess(problem, theta, noise_of(problem.samples, 0.3)))
    np.testing.assert_allclose(found.rise, chi2(2).ppf([0.5, 0.95]))
    x, y = np.meshgrid(found.first[0, 0], found.second[0, 0], indexing="ij")
    off = np.stack([x, y], axis=-1) - theta
    expected = np.einsum("ijk,kl,ijl->ij", off, np.linalg.inv(0.09 * covariance), off)
    np.testing.assert_allclose(found.above[0, 0], expected, rtol=1e-4, atol=1e-3)
    assert np.isnan(found.above[0, 1:]).all()
    edge = np.concatenate([found.above[0, 0][[0, -1]].ravel(), found.above[0, 0][:, [0, -1]].ravel()])
    assert edge.min() > found.rise[1]  # the whole region is on its map


def test_every_solution_has_its_map():
    problem = line(12, noise=0.3, squared=True)
    found = regions(assess(problem, np.array([np.sqrt(2), -1.0]), noise_of(problem.samples, 0.3)))
    assert np.sign(found.solutions[:2, 0]).tolist() in ([1.0, -1.0], [-1.0, 1.0])
    for i in range(2):
        assert found.above[0, i].min() < 0.1
        assert np.sign(found.first[0, i]).mean() == np.sign(found.solutions[i, 0])


def test_a_map_ends_at_the_bounds():
    problem = plume(3, seed=2, noise=5.0)
    found = regions(assess(problem, np.array([5.0, 5.0]), noise_of(problem.samples, 5.0)))
    assert np.nanmax(np.abs([found.first, found.second])) <= 15.0 + 1e-12
