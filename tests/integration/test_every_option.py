"""Every option of every group runs, small; so do the smallest budgets."""

from __future__ import annotations

import pytest

from fieldrl.app import places
from tests.integration.conftest import UNTRACKED, summary

GROUPS = ("vehicle", "agent", "estimator", "reward", "experiment")
CHOICES = [f"{group}={option}" for group in GROUPS for option in places.options(group)]
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


def check(run_here, tmp_path, *overrides: str) -> None:
    status, _, errors = run_here(*UNTRACKED, *overrides)
    assert (status, errors) == (0, "")
    assert summary(tmp_path)["finished"] is True


@pytest.mark.parametrize("choice", CHOICES)
def test_every_option_runs(run_here, tmp_path, choice):
    check(run_here, tmp_path, choice)


@pytest.mark.parametrize("budget", BUDGETS, ids=" ".join)
def test_the_smallest_budgets_run(run_here, tmp_path, budget):
    check(run_here, tmp_path, *budget)


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant[0].partition("=")[0])
def test_variants_that_the_configuration_names_run(run_here, tmp_path, variant):
    check(run_here, tmp_path, *variant)
