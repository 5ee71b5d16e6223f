"""Bad input: one to three lines that name the key, exit status 1, and nothing left behind."""

from __future__ import annotations

import os

import pytest

from fieldrl.cli.main import main
from tests.integration.conftest import fieldrl, fieldrl_anew

# command line, what the message must hold
CASES = {
    "an unknown option of a group": ("agent=foo", ["agent=foo", "lawnmower", "random", "sarsa_lambda"]),
    "an unknown experiment": ("experiment=foo", ["experiment=foo", "advection"]),
    "an unknown launcher": ("hydra/launcher=foo", ["hydra/launcher=foo", "joblib"]),
    "an option that is nearly right": ("pde=advektion", ["pde=advektion", "advection"]),
    "an unknown group": ("navigator=foo", ["navigator=foo", "agent"]),
    "an unknown group, appended": ("+navigator=foo", ["navigator=foo", "agent"]),
    "a null group": ("agent=null", ["agent=null", "sarsa_lambda"]),
    "an empty group": ("estimator=", ["estimator=", "least_squares"]),
    "a deleted group": ("~vehicle", ["~vehicle", "unicycle"]),
    "a null experiment": ("experiment=null", ["experiment=null", "advection"]),
    "a group given twice": ("+agent=random", ["agent=random", "leave out the +"]),
    "an unknown key at the top": ("episode=3", ["episode=3", "did you mean episodes?"]),
    "an unknown key at the top, appended": ("+episode=3", ["episode=3", "did you mean episodes?"]),
    "an unknown key at the top, forced": ("++episode=3", ["episode=3", "did you mean episodes?"]),
    "an unknown key": ("agent.step_sise=1", ["agent.step_sise=1", "did you mean step_size?"]),
    "an unknown key, appended": ("+agent.step_sise=1", ["agent.step_sise=1", "did you mean step_size?"]),
    "an unknown deep key, appended": ("+vehicle.sensor.nois=1", ["vehicle.sensor.nois=1", "noise"]),
    "an unknown key of the domain": ("pde.domain.upprr=[1,2]", ["pde.domain.upprr", "upper"]),
    "an unknown key of workers": ("+parallel.job=2", ["parallel.job=2", "jobs"]),
    "an unknown key of tracking": ("+tracking.url=x", ["tracking.url=x", "uri"]),
    "a key of hydra's that is not there": ("hydra.foo=1", ["hydra.foo=1"]),
    "a key that exists, appended": ("+seed=1", ["+seed=1", "leave out the +"]),
    "a deleted key that is needed": ("~seed", ["seed", "missing"]),
    "a deleted key that is not there": ("~foo", ["~foo"]),
    "a word for a number": ("seed=abc", ["seed=abc", "whole number"]),
    "a fraction for a whole number": ("episodes=1.5", ["episodes=1.5", "whole number"]),
    "a truth value for a number": ("steps=true", ["steps=True", "whole number"]),
    "null for a number": ("replicates=null", ["replicates=null", "whole number"]),
    "a number for a truth value": ("force=2", ["force=2", "true or false"]),
    "a negative seed": ("seed=-1", ["seed=-1", ">= 0"]),
    "no step": ("steps=0", ["steps=0", ">= 1"]),
    "no episode": ("episodes=0", ["episodes=0", ">= 1"]),
    "no replicate": ("replicates=0", ["replicates=0", ">= 1"]),
    "fewer than no evaluation episodes": ("evaluation_episodes=-1", ["evaluation_episodes=-1", ">= 0"]),
    "an empty output folder": ("output_dir=''", ["output_dir", "path of a folder"]),
    "an output folder below a file": (
        "output_dir=/dev/null/x",
        ["output_dir=/dev/null/x", "cannot be written"],
    ),
    "a value that must be given": ("seed=???", ["seed=???", "must be given"]),
    "an interpolation that leads nowhere": ("seed=${sead}", ["seed", "sead"]),
    "a list that does not end": ("vehicle.start=[1,2", ["vehicle.start=[1,2", "cannot be read"]),
    "no equals sign": ("seed", ["seed", "KEY=VALUE"]),
    "an unknown flag": ("--frobnicate", ["--frobnicate", "--help"]),
    "a list without -m": ("seed=1,2", ["seed=1,2", "-m"]),
    "a range without -m": ("seed=range(3)", ["seed=range(3)", "-m"]),
    "a number for a list": ("vehicle.start=1", ["vehicle.start=1", "list of 2"]),
    "a list that is too short": ("vehicle.start=[1]", ["vehicle.start=[1]", "list of 2"]),
    "a key below a list": ("vehicle.start.x=1", ["vehicle.start.x=1"]),
    "a word for a speed": ("vehicle.max_speed=fast", ["vehicle.max_speed=fast", "> 0"]),
    "a negative speed": ("vehicle.max_speed=-1", ["vehicle.max_speed=-1", "> 0 [length/time]"]),
    "no sensor": ("vehicle.sensor=null", ["vehicle.sensor=null"]),
    "a noise that is no number": ("vehicle.sensor.noise=nan", ["vehicle.sensor.noise=nan", "finite"]),
    "negative noise": ("vehicle.sensor.noise=-1", ["vehicle.sensor.noise=-1", ">= 0"]),
    "infinite turning": ("vehicle.turn=inf", ["vehicle.turn=inf", "finite"]),
    "a start outside the water": ("vehicle.start=[-5,20]", ["vehicle.start"]),
    "a start inside an obstacle": (
        "pde.domain.obstacles=[{_target_:fieldrl.core.domain.Circle,centre:[60,40],radius:5}]",
        ["vehicle.start"],
    ),
    "an obstacle that is none": ("pde.domain.obstacles=[3]", ["pde.domain.obstacles"]),
    "an obstacle without a radius": (
        "pde.domain.obstacles=[{_target_:fieldrl.core.domain.Circle,centre:[20,20]}]",
        ["pde.domain.obstacles.0.radius", "missing"],
    ),
    "impossible bounds": ("pde.lower=[15,15]", ["pde.", "15"]),
    "a truth outside the bounds": ("pde.true=[50,0]", ["pde.true"]),
    "an impossible domain": ("pde.domain.upper=[-1,200]", ["pde.domain.upper", "lower"]),
    "an exponent below one": ("pde.initial.exponent=0.5", ["pde.initial.exponent=0.5", "1"]),
    "an unknown kind of trace": ("agent.traces=eternal", ["agent.traces=eternal", "replacing"]),
    "a step size of zero": ("agent.step_size=0", ["agent.step_size=0"]),
    "a discount above one": ("agent.discount=1.5", ["agent.discount=1.5", "1"]),
    "tiles that fit no variable": ("agent.tile_coding.tiles=[8,8,8]", ["agent.tile_coding.tiles"]),
    "negative Tikhonov": ("estimator.tikhonov=-1", ["estimator.tikhonov=-1", ">= 0"]),
    "no start of a descent": ("estimator.starts=0", ["estimator.starts=0"]),
    "negative diffusivity": ("pde.diffusivity=-1", ["pde.diffusivity=-1", ">= 0"]),
    "bounds with a flow too fast": ("pde.upper=[1e9,1.3]", ["pde.upper", "cannot follow"]),
    "a scheme that is none": ("pde.order=4", ["pde.order=4", "3, 5, 7 or 9"]),
    "longer than a solve": ("steps=30", ["steps=30", "final_time"]),
    "no worker": ("parallel.jobs=0", ["parallel.jobs=0", "-1"]),
    "a URI that is none": ("tracking.uri=here", ["tracking.uri=here", "http"]),
    "no patience": ("tracking.patience=0", ["tracking.patience=0", "> 0"]),
    "a truth value for a source": ("pde.source=true", ["pde.source=True", "Source or null"]),
    "a number for a feature": ("pde.initial=2", ["pde.initial=2", "must be a Feature"]),
    "a number for a flow": ("pde.flow=-1", ["pde.flow=-1", "Flow"]),
    "a number for a domain": ("pde.domain=1e308", ["pde.domain=1e+308", "Domain"]),
    "null for a store": ("pde.solutions=null", ["pde.solutions=null", "Solutions"]),
    "an interval beyond all time": ("pde.interval=1e22", ["pde.interval=1e+22", "at most 1e+15"]),
    "an interval too short to keep": ("pde.interval=1e-9", ["memory", "pde.interval=1e-09"]),
    "a huge pull to the centre": ("estimator.tikhonov=1e22", ["estimator.tikhonov=1e+22", "at most"]),
    "a huge tolerance": ("estimator.tolerance=1e22", ["estimator.tolerance=1e+22", "at most"]),
    "a seed of too many digits": (f"seed={10**22}", ["seed=1", "at most"]),
    "a vehicle for an agent": (
        "agent._target_=fieldrl.vehicle.sensor.Sensor",
        ["agent.", "unknown key"],
    ),
    "another component where nobody has keys": (
        "agent={_target_:fieldrl.pde.flow.UniformFlow}",
        ["agent.", "unknown key"],
    ),
    "more episodes than memory holds": ("episodes=1000000000", ["memory", "episodes=1000000000"]),
    "more replicates than memory holds": ("replicates=1000000000", ["memory", "replicates=1000000000"]),
    "more tiles than memory holds": (
        "agent.tile_coding={tiles:1000,variables:[x,y,heading,time]}",
        ["agent.tile_coding.tiles", "features"],
    ),
    "more cells than memory holds": ("pde.cells=[10000,5000]", ["pde.cells=[10000, 5000]", "4000000 cells"]),
    "more time than there is": ("vehicle.substeps=1000000000000000", ["years", "vehicle.substeps"]),
    "a class that is not there": ("vehicle._target_=foo.Bar", ["vehicle._target_=foo.Bar", "imported"]),
    "no class": ("vehicle._target_=null", ["vehicle", "unicycle"]),
}


def check_message(text: str, wanted: list[str]) -> None:
    lines = text.strip().splitlines()
    assert 1 <= len(lines) <= 3, text
    assert all(word in text for word in wanted), text
    assert "Traceback" not in text


@pytest.mark.parametrize(("argument", "wanted"), CASES.values(), ids=CASES.keys())
def test_is_refused_in_three_lines_and_leaves_nothing(argument, wanted, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("HYDRA_FULL_ERROR", raising=False)
    assert main([argument]) == 1
    out, error = capfd.readouterr()
    assert out == ""
    check_message(error, wanted)
    assert list(tmp_path.iterdir()) == []


def test_a_grid_of_the_estimator_that_memory_cannot_hold_is_refused(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert main(["experiment=advection", "estimator.grid=1000000", "tracking=none"]) == 1
    check_message(capfd.readouterr().err, ["memory", "estimator.grid=1000000"])
    assert list(tmp_path.iterdir()) == []


def test_two_wrong_values_are_refused_one_at_a_time(tmp_path):
    finished = fieldrl(tmp_path, "seed=-1", "steps=0", tables=False)
    assert finished.returncode == 1
    check_message(finished.stderr, ["=", "must be"])
    assert list(tmp_path.iterdir()) == []


def test_a_traceback_is_shown_where_it_is_asked_for(tmp_path):
    finished = fieldrl_anew(tmp_path, "vehicle.max_speed=-1", HYDRA_FULL_ERROR="1")
    assert finished.returncode == 1
    assert "Traceback" in finished.stderr
    assert "vehicle.max_speed=-1" in finished.stderr


def test_an_exported_setting_of_hydra_is_as_it_was_afterwards(monkeypatch, capsys):
    monkeypatch.delenv("HYDRA_FULL_ERROR", raising=False)
    main(["agent=foo"])
    assert "HYDRA_FULL_ERROR" not in os.environ
