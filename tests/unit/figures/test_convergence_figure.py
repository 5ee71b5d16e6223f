import numpy as np
from matplotlib.figure import Figure

from fieldrl.figures import convergence, convergence_figure


def test_a_record_without_traces_has_no_convergence(make_record):
    record = make_record()

    assert not convergence.has_convergence(record)
    assert not convergence.has_convergence(
        record.assign(trace_best=(("fit", "solves"), np.full((2, 3), np.nan)))
    )
    assert convergence.has_convergence(make_record(traces=True))


def test_every_fit_and_their_median_are_drawn(make_record):
    (axes,) = convergence_figure(make_record(traces=True)).axes

    assert len(axes.lines) == 50 + 1
    assert axes.get_xlabel() == "Forward solves of a fit"
    assert axes.get_ylabel() == "Regret [(field unit)$^{2}$]"
    assert axes.get_yscale() == "log"


def test_a_fit_that_has_ended_keeps_its_best_loss():
    best = convergence.carried_on(convergence.padded([[4.0, 2.0], [3.0, 3.0, 1.0], [np.nan]]))

    np.testing.assert_array_equal(best, [[4.0, 2.0, 2.0], [3.0, 3.0, 1.0]])


def test_a_failed_first_solve_leaves_a_gap():
    axes = Figure().subplots()

    convergence.draw_convergence(axes, [[np.nan, 2.0, 1.0]])

    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [np.nan, 2.0, 1.0])


def test_of_very_many_fits_a_selection_is_drawn_but_all_are_counted():
    axes = Figure().subplots()

    convergence.draw_convergence(axes, np.ones((1000, 4)))

    assert len(axes.lines) <= 201
    assert axes.get_legend_handles_labels()[1][0] == "median of 1000 fits"


def test_regret_ends_at_zero_and_never_rises():
    found = convergence.regret([[4.0, 2.0], [3.0, 5.0, 1.0]])

    np.testing.assert_array_equal(found, [[2.0, 0.0, 0.0], [2.0, 2.0, 0.0]])


def test_negligible_regret_is_drawn_at_a_fraction_of_the_noise(make_record):
    (axes,) = convergence_figure(make_record(traces=True)).axes

    lowest = min(line.get_ydata()[-1] for line in axes.lines)
    np.testing.assert_allclose(lowest, 1e-4)
