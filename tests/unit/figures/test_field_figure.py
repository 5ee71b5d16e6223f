import numpy as np
import pytest
from matplotlib.patches import Circle, Rectangle

from fieldrl.figures import field_error_figure


def _panels(drawing):
    return [axes for axes in drawing.axes if axes.get_title(loc="left")]


def _images(drawing):
    return [axes.images[0] for axes in _panels(drawing)]


def test_true_and_estimated_field_share_one_scale(make_record):
    record = make_record()
    true, estimate, _ = _images(field_error_figure(record))

    assert true.get_clim() == estimate.get_clim()
    both = np.concatenate([record["field_true"].values.ravel(), record["field_estimate"].values[0].ravel()])
    assert true.get_clim() == (both.min(), both.max())


def test_the_difference_has_a_scale_symmetric_about_zero(make_record):
    record = make_record()
    difference = record["field_estimate"].values[0] - record["field_true"].values
    image = _images(field_error_figure(record))[2]

    low, high = image.get_clim()
    assert low == -high
    assert high == pytest.approx(np.abs(difference).max())
    np.testing.assert_allclose(image.get_array(), difference.T)


def test_fields_are_drawn_x_to_the_right_and_y_up_to_the_walls(make_record):
    record = make_record(upper=(200.0, 100.0), cells=(40, 30))
    image = _images(field_error_figure(record))[0]

    assert image.get_array().shape == (30, 40)
    assert image.origin == "lower"
    np.testing.assert_allclose(image.get_extent(), (0, 200, 0, 100), atol=1e-9)


def test_the_title_gives_the_root_mean_square_difference(make_record):
    record = make_record()
    record["field_estimate"][0] = record["field_true"] + 0.25

    assert _panels(field_error_figure(record))[2].get_title(loc="left").endswith("rms 0.25")


def test_both_colour_bars_carry_the_field_unit(make_record):
    record = make_record()
    record.attrs["field_unit"] = "ppb"
    bars = [bar.get_ylabel() for axes in _panels(field_error_figure(record)) for bar in axes.child_axes]

    assert len(bars) == 2
    assert all("[ppb]" in bar for bar in bars)


def test_the_chosen_replicate_is_drawn(make_record):
    record = make_record(replicates=3)
    image = _images(field_error_figure(record, replicate=2))[1]

    np.testing.assert_array_equal(image.get_array(), record["field_estimate"].values[2].T)


def test_a_perfect_estimate_is_drawn(make_record):
    record = make_record()
    record["field_estimate"][0] = record["field_true"]

    field_error_figure(record).canvas.draw()


def test_an_unknown_estimate_is_drawn_empty(make_record):
    record = make_record()
    record["field_estimate"][:] = np.nan

    drawing = field_error_figure(record)
    drawing.canvas.draw()
    assert "rms" not in _panels(drawing)[2].get_title(loc="left")


def test_obstacles_are_drawn_on_every_panel(make_record, obstacles):
    record = make_record(upper=(200.0, 100.0), obstacles=obstacles)

    for axes in _panels(field_error_figure(record)):
        assert [type(patch) for patch in axes.patches] == [Rectangle, Circle]
