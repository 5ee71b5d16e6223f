"""Pipelines on other truths and on errors of position: what they ask for can be built, and what they fit."""

import numpy as np
import pytest

from fieldrl.cli.compose import composed
from fieldrl.core.samples import Samples
from fieldrl.pde.advection import Advection
from fieldrl.runs.components import mission
from pipelines.experiments import Settings
from pipelines.paper import inverse_crime, position_errors

SMALL = Settings(scale="small")


@pytest.mark.parametrize("pipeline", [inverse_crime, position_errors])
def test_every_run_that_is_asked_for_can_be_built(pipeline):
    for wanted in pipeline.plan(Settings()).values():
        cells = ("pde.cells=[48,24]",) if wanted.experiment == "double_gyre" else ()
        assert mission(composed([f"experiment={wanted.experiment}", *wanted.overrides, *cells])).episodes > 0


def test_the_rows_differ_in_nothing_but_the_truth():
    plan = inverse_crime.plan(Settings())
    assert len(set(plan.values())) == len(plan) == len(inverse_crime.TRUTHS)
    assert set(inverse_crime.plan(SMALL)) < set(plan)


def drawn(count: int, deviation: float, seed: int) -> Samples:
    """Samples of the closed form at places all over it, measured with errors of position."""
    rng, model = np.random.default_rng(seed), Advection()
    times = rng.uniform(1, 10, count)
    positions = np.array([50.0, 50.0]) + 5.0 * times[:, None] + rng.uniform(-60, 60, (count, 2))
    values = model.predict(np.array([[5.0, 5.0]]), positions, times)[0] + rng.normal(size=count)
    return Samples.of(positions + deviation * rng.normal(size=(count, 2)), times, values)


def test_without_errors_of_position_the_estimate_is_that_of_least_squares():
    samples = drawn(200, 0.0, 0)
    found = position_errors.reweighted(Advection(), samples, np.array([5.1, 4.9]), 1.0, np.zeros(2))
    jacobian = Advection().jacobian(found[None], samples.positions, samples.times)[0]
    residuals = Advection().predict(found[None], samples.positions, samples.times)[0] - samples.values
    np.testing.assert_allclose(jacobian.T @ residuals, 0.0, atol=1e-3 * np.abs(jacobian).sum())


def test_effective_variances_let_flat_samples_count_more_and_tighten_the_estimate():
    start, variance = np.array([5.0, 5.0]), np.full(2, 4.0)
    errors = []
    for seed in range(60):
        samples = drawn(100, 2.0, seed)
        plain, weighted = (
            position_errors.reweighted(Advection(), samples, start, 1.0, known)
            for known in (np.zeros(2), variance)
        )
        errors.append((plain - start, weighted - start))
    plain, weighted = np.sqrt(np.mean(np.square(errors), axis=(0, 2)))
    assert weighted < 0.9 * plain
