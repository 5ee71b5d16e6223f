"""Configurations of jobs, composed quickly, are what Hydra composes."""

from __future__ import annotations

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.types import RunMode

from fieldrl.cli.compose import plain
from fieldrl.cli.compose_jobs import Composer
from fieldrl.core.checks import FieldrlError
from fieldrl.runs import options

JOBS = {
    "nothing": [],
    "values": ["seed=3", "agent.step_size=0.5", "vehicle.start=[30,40]"],
    "an option and a value of it": ["agent=lawnmower", "agent.margin=0.2", "seed=1"],
    "a value before its option": ["agent.margin=0.2", "agent=lawnmower"],
    "an experiment and its keys": ["experiment=advection", "episodes=2", "estimator.starts=1"],
    "an appended key": ["+agent.extra=1", "++seed=4"],
    "an interpolation": ["seed=${steps}"],
}


@pytest.fixture
def composer():
    GlobalHydra.instance().clear()
    with initialize_config_dir(config_dir=str(options.directory()), version_base="1.3"):
        hydra = GlobalHydra.instance().hydra
        assert hydra is not None
        master = hydra.compose_config("config", ["seed=0,1"], RunMode.MULTIRUN)
        yield Composer(hydra.config_loader, master)  # type: ignore[arg-type]


@pytest.mark.parametrize("overrides", JOBS.values(), ids=JOBS.keys())
def test_a_job_is_composed_as_hydra_does(composer, overrides):
    found = composer(overrides)
    assert found.config == plain(compose("config", overrides=overrides))
    assert found.overrides == tuple(overrides)


def test_the_jobs_do_not_share_anything(composer):
    composer(["seed=5", "agent.step_size=0.1"])
    assert composer([]).config == plain(compose("config"))


@pytest.mark.parametrize("override", ["agent.step_sise=1", "agent=foo", "seed=[1", "+seed=1"])
def test_what_hydra_refuses_is_refused_in_three_lines(composer, override):
    with pytest.raises(FieldrlError) as caught:
        composer(["experiment=advection", override])
    assert len(str(caught.value).splitlines()) <= 3
    assert override.lstrip("+").partition("=")[0] in str(caught.value)
