import numpy as np
import pytest

from fieldrl.figures import curves, learning_curve_figure
from fieldrl.figures.learning import window


def _labels(axes):
    return axes.get_legend_handles_labels()[1]


def test_return_and_error_are_labelled_with_their_units(make_record):
    left, right = learning_curve_figure(make_record()).axes

    assert (left.get_xlabel(), left.get_ylabel()) == ("Episode", "Return")
    assert right.get_xlabel() == "Episode"
    assert right.get_ylabel().endswith("[(field unit)$^{2}$]")


def test_one_replicate_is_drawn_raw_and_smoothed(make_record):
    record = make_record(episodes=60)
    left, right = learning_curve_figure(record).axes

    raw, mean = left.lines
    np.testing.assert_array_equal(raw.get_ydata(), record["return"].values[0])
    np.testing.assert_array_equal(raw.get_xdata(), np.arange(1, 61))
    np.testing.assert_allclose(mean.get_ydata(), curves.rolling_mean(record["return"].values[0], 7))
    assert _labels(right) == ["each episode", "rolling mean of 7", "expected, $2\\sigma^2$ = 2"]


def test_several_replicates_are_drawn_as_median_and_interquartile_band(make_record):
    record = make_record(replicates=5, episodes=60)
    left, right = learning_curve_figure(record).axes

    expected = np.median(curves.rolling_mean(record["return"].values, 7), axis=0)
    np.testing.assert_allclose(left.lines[0].get_ydata(), expected)
    assert len(left.collections) == 1
    assert "interquartile range" in _labels(right)


def test_the_error_is_that_after_the_last_sample(make_record):
    record = make_record(episodes=60)
    right = learning_curve_figure(record).axes[1]

    np.testing.assert_array_equal(right.lines[0].get_ydata(), record["e_total"].values[0, :, -1])


@pytest.mark.parametrize(("noise", "expected"), [(1.0, 2.0), (0.5, 0.5)])
def test_the_expectation_is_twice_the_noise_variance(make_record, noise, expected):
    record = make_record()
    record.attrs["noise"] = noise
    right = learning_curve_figure(record).axes[1]

    assert right.lines[-1].get_ydata()[0] == expected


def test_without_noise_there_is_no_expectation(make_record):
    record = make_record(episodes=5)
    record.attrs["noise"] = 0.0

    assert len(learning_curve_figure(record).axes[1].lines) == 1


@pytest.mark.parametrize(("worst", "scale"), [(10.0, "linear"), (1e4, "log")])
def test_the_error_has_a_logarithmic_scale_where_it_spans_decades(make_record, worst, scale):
    record = make_record()
    record["e_total"][0, 0, -1] = worst

    assert learning_curve_figure(record).axes[1].get_yscale() == scale


@pytest.mark.parametrize("replicates", [1, 3])
@pytest.mark.parametrize("episodes", [1, 2, 10])
def test_short_runs_are_drawn_too(make_record, replicates, episodes):
    drawing = learning_curve_figure(make_record(replicates=replicates, episodes=episodes))

    drawing.canvas.draw()
    ticks = drawing.axes[0].get_xticks()
    np.testing.assert_array_equal(ticks, np.round(ticks))


@pytest.mark.parametrize("replicates", [1, 3])
def test_unknown_errors_leave_gaps(make_record, replicates):
    record = make_record(replicates=replicates)
    record["e_total"][:, :10] = np.nan

    right = learning_curve_figure(record).axes[1]
    right.figure.canvas.draw()
    assert np.isnan(right.lines[0].get_ydata()[0])


@pytest.mark.parametrize("replicates", [1, 3])
def test_a_run_without_any_known_error_is_drawn(make_record, replicates):
    record = make_record(replicates=replicates)
    record["e_total"][:] = np.nan

    learning_curve_figure(record).canvas.draw()


@pytest.mark.parametrize(("episodes", "length"), [(1, 1), (10, 1), (60, 7), (400, 41), (10_000, 51)])
def test_the_rolling_mean_grows_with_the_run(episodes, length):
    assert window(episodes) == length


def test_a_rolling_mean_is_centred_and_as_long_at_the_ends():
    np.testing.assert_allclose(curves.rolling_mean([1.0, 2.0, 6.0, 4.0], 3), [3.0, 3.0, 4.0, 4.0])
    np.testing.assert_allclose(curves.rolling_mean([1.0, 2.0], 3), [1.5, 1.5])


def test_rare_large_errors_make_no_median_fall_at_the_ends():
    errors = np.where(np.random.default_rng(0).uniform(size=(200, 400)) < 0.02, 100.0, 2.0)
    median = np.median(curves.rolling_mean(errors, 51), axis=0)
    assert median[0] == pytest.approx(np.median(median), abs=1.0)
    assert median[-1] == pytest.approx(np.median(median), abs=1.0)


def test_a_rolling_mean_skips_what_is_not_finite_if_half_is_left():
    mean = curves.rolling_mean([1.0, np.nan, 3.0, np.inf, np.nan, np.nan], 3)

    np.testing.assert_allclose(mean, [2.0, 2.0, np.nan, np.nan, np.nan, np.nan])


def test_quartiles_skip_what_is_not_finite():
    low, median, high = curves.quartiles([[1.0, np.nan], [2.0, np.nan], [3.0, np.nan], [np.nan, np.nan]])

    np.testing.assert_allclose([low[0], median[0], high[0]], [1.5, 2.0, 2.5])
    assert np.isnan([low[1], median[1], high[1]]).all()
