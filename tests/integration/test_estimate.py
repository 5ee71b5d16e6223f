"""``fieldrl estimate``: the unknowns of a model from samples in a file, as a run leaves its result."""

import json

import numpy as np
import pytest
import xarray as xr

from fieldrl.cli.main import main
from fieldrl.core.streams import stream
from fieldrl.pde.advection import Advection

_ADVECTION = "experiment=advection"
THETA = np.array([5.0, 4.0])


@pytest.fixture
def samples(tmp_path, monkeypatch):
    """A CSV of 30 samples of a feature that drifts by THETA, one row of it broken."""
    monkeypatch.chdir(tmp_path)
    rng = stream(0, "samples of a test")
    times = rng.uniform(1, 10, 30)
    positions = 50 + times[:, None] * THETA + rng.normal(0, 20, (30, 2))
    values = Advection().predict(THETA[None], positions, times)[0] + rng.normal(0, 1, 30)
    rows = [f"{t},{x},{y},{v}" for t, (x, y), v in zip(times, positions, values, strict=True)]
    path = tmp_path / "samples.csv"
    path.write_text("\n".join(["time,x,y,value", *rows, "3,60,,1"]))
    return path


def estimated(*arguments):
    assert main(["estimate", *map(str, arguments), "experiment=advection", "tracking=none"]) == 0
    (folder,) = (path for path in (arguments[0].parent / "outputs" / "runs").glob("estimate-*"))
    return folder, json.loads((folder / "summary.json").read_text())


def test_samples_of_a_file_give_the_unknowns(samples, capsys):
    folder, summary = estimated(samples)
    for name, true in zip(("b_x", "b_y"), THETA, strict=True):
        one = summary["parameters"][name]
        assert abs(one["estimate"] - true) < 4 * one["std"] < 0.5
        assert one["true"] is None
    assert summary["samples"]["used"] == 30
    assert summary["samples"]["dropped"] == 1
    assert summary["e_total"] == pytest.approx(summary["e_f"] + summary["e_cv"])
    drawn = {path.stem for path in (folder / "figures").glob("*.png")}
    assert drawn == {"samples", "residuals", "fit", "field_std", "regions"}
    with xr.open_dataset(folder / "record.nc", engine="netcdf4") as record:
        assert np.isnan(record["true"]).all()
        assert np.isnan(record["field_true"]).all()
        assert 0.0 < record["field_std"].max() < 2.0 * summary["noise"]
        residual = record["residual"].values.ravel()
        assert np.mean(residual**2) == pytest.approx(summary["e_f"])
        left_out = record["residual_left_out"].values.ravel()
        assert np.mean(left_out**2) == pytest.approx(summary["e_cv"])
    capsys.readouterr()
    estimated(samples)
    assert "made before" in capsys.readouterr().out


def test_the_samples_of_a_recorded_run_give_its_pooled_estimate(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    settings = ("episodes=4", "replicates=2", "steps=8", "tracking=none", "parallel=serial")
    settings = (*settings, "pde.initial.scale=35")  # not the experiment's: the run's own model is meant
    assert main(["experiment=advection", *settings]) == 0
    (run,) = (tmp_path / "outputs" / "runs").iterdir()
    pooled = json.loads((run / "summary.json").read_text())["replicates_table"]
    for replicate in (0, 1):
        assert main(["estimate", str(run), f"measurements.replicate={replicate}", "tracking=none"]) == 0
    summaries = [json.loads(path.read_text()) for path in run.parent.glob("estimate-*/summary.json")]
    assert {one["samples"]["used"] for one in summaries} == {32}
    for name in ("b_x", "b_y"):
        expected = sorted(row["pooled"]["parameters"][name]["estimate"] for row in pooled)
        found = sorted(one["parameters"][name]["estimate"] for one in summaries)
        assert found == pytest.approx(expected, rel=1e-6)
        expected = sorted(row["pooled"]["parameters"][name]["interval"] for row in pooled)
        found = sorted(one["parameters"][name]["interval"] for one in summaries)
        assert np.allclose(found, expected, rtol=1e-6)


def test_a_model_that_explains_nothing_is_told(samples, tmp_path):
    lines = samples.read_text().splitlines()
    rows = [line.split(",") for line in lines[1:-1]]
    far = [f"{t},{float(x) * 1000},{float(y) * 1000},{v}" for t, x, y, v in rows]
    samples.write_text("\n".join([lines[0], *far]))
    _, summary = estimated(samples)
    assert summary["verdict"].startswith("The model explains 0 % of the variance")
    assert "30 of 30 samples lie outside the domain" in summary["samples"]["notes"][-1]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "one file of samples is needed"),
        (["a.csv", "b.csv"], "one file of samples is needed"),
        (["missing.csv", _ADVECTION], "missing.csv: there is no such file"),
        (["samples.csv", _ADVECTION, "measurements.thin=0"], "measurements.thin=0: must be >= 1"),
        (["samples.csv", _ADVECTION, "measurements.columns.value=salt"], "no such column"),
        (["samples.csv", "experiment=foo"], "experiment=foo: no such option"),
        (["samples.csv"], "which model is meant?"),
    ],
)
def test_what_is_refused_is_told_in_three_lines_and_leaves_nothing(samples, capsys, arguments, said):
    assert main(["estimate", *arguments]) == 1
    text = capsys.readouterr().err
    assert said in text
    assert len(text.strip().splitlines()) <= 3
    assert not (samples.parent / "outputs" / "runs").exists()


def test_a_model_from_a_folder_of_ones_own_is_estimated(samples, monkeypatch, capsys):
    folder = samples.parent / "my_conf" / "pde"
    folder.mkdir(parents=True)
    (folder / "mine.yaml").write_text(
        "_target_: plume_of_a_test.Plume\nspread: 28.284271247461902\n",
    )
    (samples.parent / "plume_of_a_test.py").write_text(_PLUME)
    monkeypatch.setenv("FIELDRL_PACKAGES", "plume_of_a_test")
    monkeypatch.syspath_prepend(samples.parent)
    given = ("estimator=least_squares", "pde=mine", "tracking=none")
    assert main(["estimate", "--config-dir", "my_conf", str(samples), *given]) == 0
    (own,) = (samples.parent / "outputs" / "runs").iterdir()
    summary = json.loads((own / "summary.json").read_text())["parameters"]
    for name, true in zip(("u", "v"), THETA, strict=True):
        assert abs(summary[name]["estimate"] - true) < 4 * summary[name]["std"] < 0.5
    assert "--config-dir=" in (own / "report.html").read_text()
    capsys.readouterr()
    assert main(["estimate", "--config-dir=nowhere", str(samples), *given]) == 1
    assert capsys.readouterr().err == "--config-dir=nowhere: there is no such folder\n"


_PLUME = '''
import numpy as np
from fieldrl.core.kinds import component
from fieldrl.core.parameters import Parameters


@component
class Plume:
    """A Gaussian feature that drifts."""

    spread: float = 40.0

    @property
    def parameters(self):
        return Parameters(("u", "v"), ("length/time",) * 2, (-15.0, -15.0), (15.0, 15.0))

    def predict(self, theta, positions, times):
        away = positions - 50.0 - np.asarray(theta)[:, None, :] * times[:, None]
        return 100.0 * np.exp(-0.5 * np.sum(away**2, axis=-1) / self.spread**2)
'''
