import matplotlib
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf

from fieldrl.figures import draw_run, style


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        ("length", "$x$ [length]"),
        ("1", "$x$"),
        ("", "$x$"),
        ("m^2", "$x$ [m$^{2}$]"),
        ("length/time^2", "$x$ [length/time$^{2}$]"),
        ("field unit^2", "$x$ [(field unit)$^{2}$]"),
    ],
)
def test_a_label_names_the_quantity_and_its_unit(unit, text):
    assert style.quantity("$x$", unit) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.02, "0.02"), (500.0, "500"), (1e6, "$10^{6}$"), (2e-5, r"2$\times 10^{-5}$"), (1e-4, "$10^{-4}$")],
)
def test_ticks_of_a_logarithmic_axis_read_as_plain_numbers(value, text):
    assert style.plain(value) == text


@pytest.mark.parametrize("colours", [style.SEQUENTIAL, style.LEVEL_LINES, style.LEVEL_FILLS])
def test_sequential_colours_grow_darker_all_the_way(colours):
    luminance = colours(np.linspace(0, 1, 64))[:, :3] @ [0.2126, 0.7152, 0.0722]

    assert np.all(np.diff(luminance) < 0)


def test_drawing_leaves_global_settings_alone(make_record, tmp_path):
    before = dict(matplotlib.rcParams)

    draw_run(make_record(), tmp_path)

    assert dict(matplotlib.rcParams) == before


def test_no_figure_is_left_in_pyplot_s_hands(make_record, tmp_path):
    draw_run(make_record(), tmp_path)

    assert not Gcf.figs
