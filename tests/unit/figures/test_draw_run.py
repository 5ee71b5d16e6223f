import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr
from matplotlib.image import imread

from fieldrl.figures import draw_run, style
from tests.unit.figures.conftest import build

NAMES = ["course.png", "path.png", "learning_curve.png", "field_error.png", "residuals.png"]


@pytest.fixture
def coarse(monkeypatch):
    """Pictures of few pixels, where only whether they can be drawn matters."""
    monkeypatch.setattr(style, "DPI", 40)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A record as it was before its pictures were drawn and as it is after, and the pictures."""
    record = build()
    before = record.copy(deep=True)
    return before, record, draw_run(record, tmp_path_factory.mktemp("run") / "figures")


def test_a_run_leaves_five_pictures(drawn):
    *_, pictures = drawn
    assert [picture.name for picture in pictures] == NAMES
    for picture in pictures:
        height, width, _ = imread(picture).shape
        assert width > 500
        assert height > 200


def test_traces_of_the_fits_add_one_more(make_record, tmp_path, coarse):
    names = [picture.name for picture in draw_run(make_record(traces=True), tmp_path)]

    assert names == [*NAMES, "convergence.png"]


def test_each_picture_says_of_which_run_it_is(drawn):
    for picture in drawn[-1]:
        note = json.loads(picture.with_suffix(".json").read_text())
        assert note == {
            "file": picture.name,
            "experiment": "made_up",
            "keys": ["0123456789ab"],
            "version": "0.1.0",
        }


def test_only_pictures_and_their_notes_are_left(drawn):
    *_, pictures = drawn
    expected = {picture.with_suffix(end).name for picture in pictures for end in (".png", ".json")}
    assert {path.name for path in pictures[0].parent.iterdir()} == expected


def test_drawing_does_not_change_the_record(drawn):
    before, record, _ = drawn
    assert record.identical(before)


def test_a_stored_record_gives_the_same_bytes(make_record, tmp_path, coarse, obstacles):
    record = make_record(replicates=2, upper=(200.0, 100.0), obstacles=obstacles)
    record.to_netcdf(tmp_path / "record.nc", engine="scipy")

    with xr.open_dataset(tmp_path / "record.nc", engine="scipy") as stored:
        pairs = zip(draw_run(record, tmp_path / "a"), draw_run(stored.load(), tmp_path / "b"), strict=True)
        assert all(a.read_bytes() == b.read_bytes() for a, b in pairs)


def test_the_same_record_gives_the_same_bytes_alone_and_in_threads(make_record, tmp_path, coarse):
    alone = [path.read_bytes() for path in draw_run(make_record(), tmp_path / "alone")]
    with ThreadPoolExecutor(2) as pool:
        runs = list(pool.map(lambda i: draw_run(make_record(), tmp_path / str(i)), range(2)))

    assert all([path.read_bytes() for path in run] == alone for run in runs)


@pytest.mark.parametrize(
    ("replicates", "episodes", "upper"),
    [
        (1, 1, (200.0, 200.0)), (3, 30, (200.0, 200.0)), (1, 30, (200.0, 100.0)),
        (3, 1, (200.0, 100.0)), (1, 1, (50.0, 200.0)), (3, 30, (50.0, 200.0)),
    ],
)  # fmt: skip
def test_runs_of_every_shape_are_drawn(make_record, tmp_path, coarse, replicates, episodes, upper):
    record = make_record(replicates=replicates, episodes=episodes, steps=3, upper=upper)

    assert len(draw_run(record, tmp_path)) == len(NAMES)


def test_a_run_whose_fits_all_failed_is_drawn(make_record, tmp_path, coarse):
    record = make_record(replicates=2, episodes=3)
    record["e_total"][:] = np.nan
    record["return"][:] = np.nan
    record["field_estimate"][:] = np.nan

    assert len(draw_run(record, tmp_path)) == len(NAMES)
