import numpy as np
import pytest
from matplotlib.contour import ContourSet
from matplotlib.patches import Circle, Rectangle

from fieldrl.figures import maps, path_figure
from fieldrl.figures.paths import notable_episodes


def _panels(drawing):
    return [axes for axes in drawing.axes if axes.get_title(loc="left")]


def _line(axes, name):
    return next(line for line in axes.lines if line.get_label() == name)


def test_first_best_and_last_episode_have_a_panel_each(make_record):
    record = make_record(episodes=9)
    record["best_episode"][0] = 4

    titles = [axes.get_title(loc="left").splitlines()[0] for axes in _panels(path_figure(record))]

    assert titles == ["Episode 1 (first)", "Episode 5 (best)", "Episode 9 (last)"]


@pytest.mark.parametrize(("episodes", "best", "panels"), [(1, 0, 1), (2, 1, 2), (5, 0, 2), (5, 3, 3)])
def test_an_episode_is_drawn_once(make_record, episodes, best, panels):
    record = make_record(episodes=episodes)
    record["best_episode"][0] = best

    assert len(_panels(path_figure(record))) == panels


def test_an_episode_keeps_the_number_of_its_coordinate(make_record):
    record = make_record(episodes=3).assign_coords(episode=[0, 1, 2])

    assert next(iter(notable_episodes(record).values())).startswith("Episode 0")


def test_the_path_leads_from_the_start_through_every_sample(make_record):
    record = make_record(episodes=3, steps=7)
    axes = _panels(path_figure(record))[0]
    first = record["position"].values[0, 0]

    np.testing.assert_array_equal(_line(axes, "sample").get_xydata(), first)
    np.testing.assert_array_equal(_line(axes, "start").get_xydata(), record["start"].values[None])
    path = max((line.get_xydata() for line in axes.lines), key=len)
    np.testing.assert_array_equal(path, np.vstack([record["start"].values, first]))


def test_axes_carry_the_record_s_length_unit(make_record):
    record = make_record()
    record.attrs["length_unit"] = "km"
    axes = _panels(path_figure(record))

    assert axes[0].get_xlabel() == "$x$ [km]"
    assert [each.get_ylabel() for each in axes] == ["$y$ [km]", *[""] * (len(axes) - 1)]


def test_level_sets_lie_within_the_field_and_are_round_numbers(make_record):
    record = make_record()
    (sets, *_) = [
        each for each in _panels(path_figure(record))[0].collections if isinstance(each, ContourSet)
    ]

    assert 5 <= len(sets.levels) <= 10
    assert sets.levels.min() > float(record["field_true"].min())
    assert sets.levels.max() < float(record["field_true"].max())
    np.testing.assert_allclose(np.diff(sets.levels), sets.levels[1] - sets.levels[0])


def test_the_colour_bar_names_field_time_and_unit(make_record):
    drawing = path_figure(make_record(steps=20))
    bars = [child.get_ylabel() for axes in drawing.axes for child in axes.child_axes]

    assert len(bars) == 1
    assert "= 20)" in bars[0]
    assert "[field unit]" in bars[0]


def test_a_constant_field_has_no_level_sets(make_record):
    record = make_record()
    record["field_true"][:] = 3.0

    assert maps.levels(record["field_true"]).size == 0
    assert len(_panels(path_figure(record))) >= 1


def test_obstacles_are_drawn_on_every_map(make_record, obstacles):
    record = make_record(upper=(200.0, 100.0), obstacles=obstacles)

    for axes in _panels(path_figure(record)):
        assert [type(patch) for patch in axes.patches] == [Rectangle, Circle]


def test_maps_have_equal_aspect_and_show_the_whole_domain(make_record):
    record = make_record(upper=(200.0, 100.0))

    for axes in _panels(path_figure(record)):
        assert axes.get_aspect() == 1.0
        assert (axes.get_xlim(), axes.get_ylim()) == ((0.0, 200.0), (0.0, 100.0))


def test_an_unknown_error_is_called_unknown(make_record):
    record = make_record(episodes=1)
    record["e_total"][:] = np.nan

    assert "unknown" in _panels(path_figure(record))[0].get_title(loc="left")
