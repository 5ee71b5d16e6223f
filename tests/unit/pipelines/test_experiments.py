import numpy as np
import pytest
import xarray as xr

from fieldrl.core.checks import InvalidValue
from pipelines import experiments
from pipelines.experiments import Settings, Wanted

TINY = Wanted("advection", ("replicates=1", "episodes=1", "steps=2", "evaluation_episodes=0"))


@pytest.fixture
def here(tmp_path):
    return Settings(scale="small", output_dir=str(tmp_path), jobs=1)


def test_settings_are_read_from_the_command_line():
    found = Settings.of(["scale=small", "tracking=mlflow", "jobs=2"])
    assert found == Settings("small", "mlflow", "outputs", 2)


@pytest.mark.parametrize("argument", ["small", "scale=tiny", "scal=small", "jobs=0", "jobs=many", "scale="])
def test_an_unknown_option_or_value_is_refused(argument):
    with pytest.raises(InvalidValue):
        Settings.of([argument])


def test_a_missing_run_is_computed_and_a_finished_one_is_not(here, capsys, monkeypatch):
    assert experiments.ensure([TINY.at(here), TINY.at(here)], here) == 1
    assert "computed 1 of 1" in capsys.readouterr().out
    monkeypatch.setattr(experiments, "performed", None)  # would fail if it were called
    assert experiments.ensure([TINY.at(here)], here) == 0
    found = experiments.find({"tiny": TINY}, here)["tiny"]
    assert found.record.sizes["episode"] == 1
    assert capsys.readouterr().out == ""


def test_the_place_of_results_and_their_tracking_are_no_part_of_a_run(here, tmp_path):
    experiments.ensure([TINY.at(here)], here)
    tracked = Settings("small", "mlflow", str(tmp_path))
    assert experiments.ensure([TINY.at(tracked)], tracked) == 0


def test_the_scale_comes_before_what_a_pipeline_declares(here):
    assert TINY.at(here).overrides[-4:] == TINY.overrides
    assert TINY.at(here).overrides[0].startswith("replicates=")


def test_what_is_derived_from_records_is_computed_once_for_the_same_parts(here):
    calls = []

    def compute():
        calls.append(1)
        return xr.Dataset({"a": ("x", np.arange(3.0))})

    for parts in (["key", 1], ["key", 1], ["key", 2]):
        found = experiments.kept(here, "numbers", parts, compute)
    np.testing.assert_array_equal(found["a"], [0, 1, 2])
    assert len(calls) == 2


def test_an_error_is_told_in_a_line(monkeypatch):
    monkeypatch.setattr("sys.argv", ["figure", "scale=tiny"])
    with pytest.raises(SystemExit, match="scale=tiny: must be one of paper, small"):
        experiments.command(lambda settings: None)
