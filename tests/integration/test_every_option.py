"""Every option of every group runs, small; so do the smallest budgets."""

from __future__ import annotations

import pytest

from fieldrl.runs import options
from tests.integration.conftest import SMALLEST, summary

GROUPS = ("vehicle", "agent", "reward")
SMALL = (
    "experiment=advection", "episodes=2", "steps=3", "evaluation_episodes=1", "replicates=1", "tracking=none",
)  # fmt: skip
ESTIMATORS = {
    "least_squares": (),
    "composite": (),
    "gaussian_process": ("estimator.budget=4", "estimator.initial=3"),
}
CHOICES = [f"{group}={option}" for group in GROUPS for option in options.options(group)]
NEEDS = {"agent=informed_sarsa_lambda": ("observation=informed",)}
BUDGETS = [
    ("episodes=1", "steps=1", "evaluation_episodes=0", "replicates=1"),
    ("episodes=2", "steps=2", "evaluation_episodes=1", "replicates=1"),
]
VARIANTS = [
    ("estimator.starts=1",),
    ("agent.traces=dutch",),
    ("agent.tile_coding.variables=[x,y,heading,time]", "agent.tile_coding.tiles=4"),
    ("vehicle.sensor.covariance=[0.1,0.1,0.01]",),
    ("vehicle.sensor.noise=0",),
    ("pde.domain.obstacles=[{_target_:fieldrl.core.domain.Circle,centre:[90,60],radius:10}]",),
    ("pde.source={_target_:fieldrl.pde.source.LocalisedSource,strength:5,centre:[80,80],width:10}",),
]


def check(run_here, tmp_path, *overrides: str, small: tuple[str, ...] = SMALL) -> None:
    status, _, errors = run_here(*small, *overrides)
    assert (status, errors) == (0, "")
    assert summary(tmp_path)["finished"] is True


@pytest.mark.parametrize("choice", CHOICES)
def test_every_option_runs(run_here, tmp_path, choice):
    check(run_here, tmp_path, choice, *NEEDS.get(choice, ()))


@pytest.mark.parametrize("experiment", options.options("experiment"))
def test_every_experiment_runs(run_here, tmp_path, experiment):
    check(run_here, tmp_path, f"experiment={experiment}", small=SMALLEST)


@pytest.mark.parametrize("experiment", ["advection", "double_gyre"])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_every_estimator_runs_on_both_models(run_here, tmp_path, estimator, experiment):
    chosen = (f"experiment={experiment}", f"estimator={estimator}", *ESTIMATORS[estimator])
    if experiment == "double_gyre":
        chosen = (*chosen, "pde.cells=[48,24]")
    if (estimator, experiment) == ("least_squares", "double_gyre"):
        chosen = (*chosen, "estimator.starts=1", "steps=1")
    small = [override for override in SMALLEST if override.partition("=")[0] not in " ".join(chosen)]
    check(run_here, tmp_path, *chosen, small=tuple(small))


def test_every_estimator_is_tried():
    assert set(ESTIMATORS) == set(options.options("estimator"))


@pytest.mark.parametrize("budget", BUDGETS, ids=" ".join)
def test_the_smallest_budgets_run(run_here, tmp_path, budget):
    check(run_here, tmp_path, *budget)


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant[0].partition("=")[0])
def test_variants_that_the_configuration_names_run(run_here, tmp_path, variant):
    check(run_here, tmp_path, *variant)
