"""``fieldrl suggest``: from samples or an estimate to the next samples, on disk as a table and a picture."""

import csv
import json

import numpy as np
import pytest

from fieldrl.cli.main import main
from fieldrl.core.streams import stream
from fieldrl.pde.advection import Advection

SETTINGS = ("experiment=advection", "tracking=none")
THETA = np.array([5.0, 4.0])


@pytest.fixture
def samples(tmp_path, monkeypatch):
    """A CSV of 15 samples with dates, longitudes and latitudes; the model counts kilometres and hours."""
    monkeypatch.chdir(tmp_path)
    rng = stream(0, "samples of a test")
    times = np.sort(rng.uniform(1, 8, 15))
    positions = 50 + times[:, None] * THETA + rng.normal(0, 20, (15, 2))
    values = Advection().predict(THETA[None], positions, times)[0] + rng.normal(0, 1, 15)
    degree = 6371.0088 * np.deg2rad(1.0)
    latitude = 54.0 + positions[:, 1] / degree
    longitude = 10.0 + positions[:, 0] / degree / np.cos(np.deg2rad(54.0))
    start = np.datetime64("2023-04-20T10:00:00")
    dates = start + np.round(times * 3600).astype("timedelta64[s]")
    rows = [f"{d},{x},{y},{v}" for d, x, y, v in zip(dates, longitude, latitude, values, strict=True)]
    path = tmp_path / "samples.csv"
    path.write_text("\n".join(["time,longitude,latitude,value", *rows]))
    return path


READING = (
    "measurements.origin=[10,54]",
    "measurements.units={length: 1 km, time: 1 h}",
    "measurements.start=2023-04-20T10:00",
)


def test_samples_give_an_estimate_and_the_next_samples_in_the_units_of_the_file(samples, capsys):
    words = (str(samples), *SETTINGS, *READING)
    assert main(["suggest", *words, "count=3", "times=[9,10]", "apart=10"]) == 0
    shown = capsys.readouterr().out
    assert "now" in shown
    (folder,) = (samples.parent / "outputs" / "runs").iterdir()
    with (folder / "suggestion.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3
    std = json.loads((folder / "summary.json").read_text())["parameters"]["b_x"]["std"]
    assert float(rows[-1]["std_b_x"]) < float(rows[0]["std_b_x"]) < std
    degree = 6371.0088 * np.deg2rad(1.0)
    for row in rows:
        assert row["date"] == f"2023-04-20T{10 + int(float(row['time']))}:00:00"
        east = (float(row["longitude"]) - 10) * degree * np.cos(np.deg2rad(54))
        assert east == pytest.approx(float(row["x"]), rel=1e-6)
        assert (float(row["latitude"]) - 54) * degree == pytest.approx(float(row["y"]), rel=1e-6)
    assert (folder / "figures" / "suggestion.png").stat().st_size > 10_000
    assert json.loads((folder / "figures" / "suggestion.json").read_text())["keys"] == [folder.name[9:]]

    mooring = samples.parent / "moorings.csv"
    mooring.write_text("longitude,latitude\n11.3,54.9\n11.5,54.6\n")
    for name in (str(folder), folder.name[:14]):  # the estimate is found by its folder and its key
        assert main(["suggest", name, f"places={mooring}", "count=1", "times=9"]) == 0
    with (folder / "suggestion.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (round(float(row["longitude"]), 6), round(float(row["latitude"]), 6)) in (
        (11.3, 54.9),
        (11.5, 54.6),
    )

    for arguments, said in (
        ([], "one file of samples is needed"),
        (["estimate-123"], "no such run"),
        ([folder.name, "count=many"], "count=many: must be a whole number"),
        ([folder.name, "places=nowhere.csv"], "nowhere.csv: there is no such file"),
        ([folder.name, "times=[-1]"], "must lie between 0 and"),
        ([folder.name, "many=5"], "many=5: not understood here"),
    ):
        assert main(["suggest", *arguments]) == 1
        text = capsys.readouterr().err
        assert said in text
        assert len(text.strip().splitlines()) <= 3
