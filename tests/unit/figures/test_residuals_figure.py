import numpy as np

from fieldrl.figures import residuals


def test_every_sample_and_the_best_episode_stand_along_time(make_record):
    record = make_record(replicates=2, episodes=3, steps=4)
    left, right = residuals.mission_residuals_figure(record).axes

    _, every, best = left.lines
    first = record.isel(replicate=0)
    np.testing.assert_array_equal(every.get_ydata(), first["pooled_residual"].values.ravel())
    chosen = first.isel(episode=int(first["best_episode"]))
    np.testing.assert_array_equal(best.get_ydata(), chosen["pooled_residual"].values)
    np.testing.assert_array_equal(best.get_xdata(), chosen["time"].values)
    assert np.max(np.asarray(right.lines[0].get_ydata())) <= 1 / np.sqrt(
        2 * np.pi
    )  # the density of sigma = 1


def test_a_record_without_residuals_has_no_such_picture(make_record):
    record = make_record(episodes=2)
    assert residuals.has_residuals(record)
    assert not residuals.has_residuals(record.assign(pooled_residual=record["pooled_residual"] * np.nan))
    assert not residuals.has_residuals(record.drop_vars("pooled_residual"))
