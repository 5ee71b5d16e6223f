"""Files of samples: what is read of a good one, what is said of a bad one, what is counted and left out."""

import contextlib
import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from fieldrl.core.checks import InvalidValue
from fieldrl.core.samples import Samples
from fieldrl.measurements import usable as limits
from fieldrl.measurements.sample_file import INCOMPLETE, REPEATED, THINNED, SampleFile
from fieldrl.measurements.table import Unreadable
from fieldrl.measurements.usable import usable
from fieldrl.pde.advection import Advection
from fieldrl.pde.advection_diffusion import AdvectionDiffusion

ROWS = {"time": [1.0, 2.0, 3.0], "x": [10.0, 20.0, 30.0], "y": [5.0, 6.0, 7.0], "value": [0.5, 1.5, 2.5]}
GOOD = "time,x,y,value\n1,10,5,0.5\n2,20,6,1.5\n3,30,7,2.5\n"
DATA = Path(os.environ.get("FIELDRL_DATA", Path(__file__).resolve().parents[4] / "shared" / "data"))
real = pytest.mark.skipif(not DATA.is_dir(), reason=f"no ocean data at {DATA}")


def content(samples):
    return np.column_stack([samples.times, samples.positions, samples.values])


EXPECTED = np.column_stack([ROWS["time"], ROWS["x"], ROWS["y"], ROWS["value"]])


def written(folder, text, name="samples.csv", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return path


def refusal(folder, text, name="samples.csv", encoding="utf-8", **settings):
    """What is said of a bad file: one to three lines that begin with its name."""
    with pytest.raises(Unreadable) as caught:
        SampleFile(**settings).read(written(folder, text, name, encoding))
    message = str(caught.value)
    assert message.startswith(str(folder / name))
    assert len(message.splitlines()) <= 3
    return message


@pytest.mark.parametrize(
    "text",
    [
        GOOD,
        GOOD.replace(",", ";"),
        GOOD.replace(",", "\t"),
        GOOD.replace(",", "  "),
        "# taken by hand\n" + GOOD,
        "Time,X,Y,Value,remark\n1,10,5,0.5,ok\n2,20,6,1.5,\n3,30,7,2.5,wind\n",
        "time [time],x [length],y (length),value [mg/l]\n1,10,5,0.5\n2,20,6,1.5\n3,30,7,2.5\n",
    ],
)
def test_text_of_any_usual_make_is_read(tmp_path, text):
    assert np.array_equal(content(SampleFile().read(written(tmp_path, text)).samples), EXPECTED)


def test_a_byte_order_mark_and_another_encoding_are_read(tmp_path):
    marked = written(tmp_path, "\ufeff" + GOOD)
    assert len(SampleFile().read(marked).samples) == 3
    latin = written(tmp_path, "time,x,y,value,Ort\n1,10,5,0.5,Fähre\n", "latin.csv", "latin-1")
    assert len(SampleFile(encoding="latin-1").read(latin).samples) == 1


def test_parquet_netcdf_frames_and_mappings_give_the_same_samples(tmp_path):
    frame = pd.DataFrame(ROWS)
    frame.to_parquet(tmp_path / "samples.parquet")
    data = xr.Dataset({name: ("row", values) for name, values in ROWS.items()})
    data.to_netcdf(tmp_path / "samples.nc", engine="netcdf4")
    data.to_netcdf(tmp_path / "classic.nc", engine="scipy")
    reader = SampleFile()
    for name in ("samples.parquet", "samples.nc", "classic.nc"):
        assert np.array_equal(content(reader.read(tmp_path / name).samples), EXPECTED)
    assert np.array_equal(content(reader.of(frame).samples), EXPECTED)
    assert np.array_equal(content(reader.of(ROWS).samples), EXPECTED)


def test_columns_are_named_by_the_setting(tmp_path):
    path = written(tmp_path, "hour,east,north,salt,error\n1,10,5,0.5,0.1\n2,20,6,1.5,0.2\n")
    names = {"time": "hour", "x": "east", "y": "north", "value": "salt", "std": "error"}
    samples = SampleFile(columns=names).read(path).samples
    assert np.array_equal(content(samples), EXPECTED[:2])
    assert np.array_equal(samples.std, [0.1, 0.2])


def test_a_cf_trajectory_is_read_by_its_standard_names(tmp_path):
    """Two drifters of different lengths, padded; degrees and dates become the model's units."""
    times = pd.to_datetime(["2023-04-20 00:00", "2023-04-20 06:00", "2023-04-20 12:00"])
    data = xr.Dataset(
        {
            "when": (("trajectory", "obs"), [times, [times[0], times[1], pd.NaT]]),
            "salinity": (("trajectory", "obs"), [[30.0, 31.0, 32.0], [33.0, 34.0, np.nan]]),
            "phi": (("trajectory", "obs"), [[54.0, 54.1, 54.2], [54.3, 54.4, np.nan]]),
            "lam": (("trajectory", "obs"), [[10.0, 10.0, 10.1], [10.2, 10.2, np.nan]]),
        },
        attrs={"featureType": "trajectory", "Conventions": "CF-1.11"},
    )
    data.when.attrs["standard_name"] = "time"
    data.phi.attrs |= {"standard_name": "latitude", "units": "degrees_north"}
    data.lam.attrs |= {"standard_name": "longitude", "units": "degrees_east"}
    data.to_netcdf(tmp_path / "drifters.nc", engine="netcdf4")
    reader = SampleFile(
        columns={"value": "salinity"}, units={"length": "1 km", "time": "6 h"}, origin=[10.0, 54.0]
    )
    reading = reader.read(tmp_path / "drifters.nc")
    assert reading.dropped == {INCOMPLETE: 1}
    assert np.allclose(reading.samples.times, [0, 0, 1, 1, 2])
    assert np.allclose(reading.samples.values, [30, 33, 31, 34, 32])
    degree = 6371.0088 * np.pi / 180
    assert np.allclose(reading.samples.positions[2], [0.0, 0.1 * degree])
    assert np.allclose(reading.samples.positions[4], [0.1 * degree * np.cos(np.deg2rad(54)), 0.2 * degree])


def test_rows_that_cannot_be_used_are_counted(tmp_path):
    text = "time,x,y,value\n3,30,7,2.5\n1,10,5,0.5\n2,,6,1.5\n2,20,6,NA\n2,20,6,inf\n1,10,5,0.5\n2,20,6,1.5\n"
    reading = SampleFile().read(written(tmp_path, text))
    assert np.array_equal(content(reading.samples), EXPECTED)
    assert reading.rows == 7
    assert reading.dropped == {INCOMPLETE: 3, REPEATED: 1}
    assert "order of time" in " ".join(reading.notes)


def test_two_values_at_one_time_and_place_are_two_samples(tmp_path):
    text = "time,x,y,value\n1,10,5,0.5\n1,10,5,0.6\n"
    assert np.array_equal(SampleFile().read(written(tmp_path, text)).samples.values, [0.5, 0.6])


def test_thinning_is_counted(tmp_path):
    reading = SampleFile(thin=2).read(written(tmp_path, GOOD))
    assert np.array_equal(content(reading.samples), EXPECTED[::2])
    assert reading.dropped == {THINNED: 1}


def test_a_detection_limit_is_read_from_the_value_or_set(tmp_path):
    text = "time,x,y,value\n1,10,5,<0.5\n2,20,6,1.5\n"
    samples = SampleFile().read(written(tmp_path, text)).samples
    assert np.array_equal(samples.values, [0.5, 1.5])
    assert np.array_equal(samples.censored, [True, False])
    samples = SampleFile(detection_limit=1.0).read(written(tmp_path, GOOD)).samples
    assert np.array_equal(samples.values, [1.0, 1.5, 2.5])
    assert np.array_equal(samples.censored, [True, False, False])


def test_dates_in_text_count_from_the_start(tmp_path):
    text = "time,x,y,value\n20-Apr-2023 10:00:00,1,2,3\n20-Apr-2023 16:00:00,2,3,4\n"
    path = written(tmp_path, text)
    units = {"time": "6 h"}
    assert np.allclose(SampleFile(units=units).read(path).samples.times, [0, 1])
    reader = SampleFile(units=units, start="2023-04-20T04:00:00Z")
    assert np.allclose(reader.read(path).samples.times, [1, 2])


def test_metres_become_the_length_of_the_model(tmp_path):
    text = "time [s],x [m],y [km],value\n3600,1500,2.5,3\n7200,2500,3.5,4\n"
    reader = SampleFile(units={"length": "500 m", "time": "1 h"}, origin=[500.0, 0.5])
    samples = reader.read(written(tmp_path, text)).samples
    assert np.allclose(samples.times, [1, 2])
    assert np.allclose(samples.positions, [[2, 4], [4, 6]])


@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        ("", {}, "is empty"),
        ("time,x,y,value\n", {}, "has no rows"),
        ("t,x,y,salt\n1,2,3,4\n", {}, "no column value; the columns are t, x, y, salt"),
        (GOOD, {"columns": {"value": "vlaue"}}, "measurements.columns.value=vlaue: no such column"),
        (GOOD.replace("1.5", "high"), {}, "value: row 2 holds 'high', no number"),
        (GOOD.replace("20,6", "'20',6"), {}, "x: row 2 holds"),
        ("time;x;y;value\n1;2;3;4,5\n", {}, "a decimal comma? measurements.decimal=','"),
        (GOOD.replace("time", "time [h]"), {}, "'measurements.units.time=6 h'"),
        (GOOD.replace("x,", "x [furlong],"), {}, "'furlong', which is none of mm, cm, m"),
        (GOOD.replace("x,y", "lon,lat"), {}, "they span 10 to 30 and 5 to 7"),
        (GOOD.replace("x,y", "lon,y"), {}, "one of x and y is in degrees"),
        ("time,x,y,value\n03/04/2023 10:00,1,2,3\n", {}, "may be day or month first"),
        ("time,x,y,value\nMonday,1,2,3\n", {}, "time: row 1 holds 'Monday', no date and no number"),
        ("time,x,y,value,std\n1,2,3,4,0\n", {}, "std: row 1 holds 0, which must be > 0"),
        ("time,x,y,value [m],std [cm]\n1,2,3,4,1\n", {}, "std is in cm, value in m"),
        (GOOD + "4,5\n6,7,8,9,10,11\n", {}, "cannot be read as a table"),
    ],
)
def test_a_bad_table_is_refused_by_name(tmp_path, text, settings, said):
    assert said in refusal(tmp_path, text, **settings)


def test_files_that_are_no_tables_are_refused(tmp_path):
    assert "is no text in utf-8" in refusal(tmp_path, "time,x,y,Größe\n", encoding="latin-1")
    assert "cannot be read as NetCDF" in refusal(tmp_path, GOOD, "samples.nc")
    assert "cannot be read as Parquet" in refusal(tmp_path, GOOD, "samples.parquet")
    assert "must be one of .csv" in refusal(tmp_path, GOOD, "samples.xlsx")
    with pytest.raises(Unreadable, match="there is no such file"):
        SampleFile().read(tmp_path / "missing.csv")
    with pytest.raises(Unreadable, match=r"is a folder without record\.nc"):
        SampleFile().read(tmp_path)


@pytest.mark.parametrize(
    "settings",
    [
        {"columns": {"salt": "x"}},
        {"columns": {"x": 3}},
        {"units": {"length": "1 parsec"}},
        {"units": {"time": "-1 h"}},
        {"std": 0.0},
        {"thin": 0},
        {"decimal": "x"},
        {"origin": [1.0]},
        {"origin": "north"},
    ],
)
def test_bad_settings_are_refused(settings):
    with pytest.raises(InvalidValue):
        SampleFile(**settings)


def test_what_the_model_cannot_predict_is_counted():
    model = AdvectionDiffusion(cells=(48, 24), final_time=5.0)
    positions = [[50, 50], [50, 50], [50, 50], [50, 50], [50, 500], [60, 40]]
    reading = SampleFile().of(Samples.of(positions, [-1, 1, 2, 6, 3, 4], [1, 2, 3, 4, 5, 6]))
    found = usable(reading, model)
    assert np.array_equal(found.samples.values, [2, 3, 6])
    assert found.dropped == {limits.EARLY: 1, limits.LATE: 1, limits.OUTSIDE: 1}


def test_too_few_samples_are_refused_with_what_became_of_the_rest():
    reading = SampleFile().of(Samples.of([[50, 50]] * 3, [20.0, 1, 30.0], [1, 2, 3]))
    with pytest.raises(Unreadable, match=r"1 usable samples of 3 rows \(2: after the model's last time\)"):
        usable(reading, AdvectionDiffusion(cells=(48, 24), final_time=5.0))


def test_a_model_in_the_open_takes_samples_from_everywhere():
    reading = SampleFile().of(Samples.of([[-50, 500]] * 3, [1, 2, 3], [1, 2, 3]))
    assert len(usable(reading, Advection()).samples) == 3


@real
def test_real_drifters_are_read():
    names = {"time": "date_UTC", "value": "U_speed_mps"}
    reader = SampleFile(columns=names, origin=[10.1, 54.3], units={"length": "1 km", "time": "1 h"})
    reading = reader.read(DATA / "drifters" / "drifters_geomar_kiel_202304_raw.csv")
    samples = reading.samples
    assert len(samples) + sum(reading.dropped.values()) == reading.rows == 19513
    assert np.all(np.diff(samples.times) >= 0)
    assert np.abs(samples.positions[0] - [3.19, 3.30]).max() < 0.01


@real
def test_real_currents_are_samples_too():
    reader = SampleFile(
        columns={"value": "u_eastward"}, units={"length": "1 km", "time": "1 h"}, select={"depth": 0}
    )
    reading = reader.read(DATA / "currents" / "norkyst800v3_zdepth_hourly_20250131.nc")
    assert reading.rows == 5 * 11 * 16
    assert len(reading.samples) + sum(reading.dropped.values()) == reading.rows


@real
@pytest.mark.parametrize("path", sorted((DATA / "hostile").glob("*.nc")), ids=lambda path: path.stem)
def test_hostile_files_are_refused_or_counted(path):
    reader = SampleFile(columns={"value": "u"}, origin=[0, 0], units={"length": "1 km", "time": "1 h"})
    with contextlib.suppress(Unreadable):
        reading = reader.read(path)
        assert len(reading.samples) + sum(reading.dropped.values()) == reading.rows
