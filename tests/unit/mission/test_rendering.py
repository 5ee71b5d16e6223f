"""What an environment shows."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from fieldrl.core.checks import FieldrlError
from fieldrl.core.domain import Domain, Rectangle
from fieldrl.mission.rendering import SIDE, Window
from fieldrl.pde.advection import Advection
from fieldrl.vehicle.unicycle import Unicycle

VEHICLE, OBSTACLE = (213, 94, 0), (140, 140, 140)


def where(image, colour):
    """Mean row and column of a colour."""
    return np.argwhere((image == colour).all(axis=-1)).mean(axis=0)


@pytest.fixture
def environment(mission):
    domain = Domain(upper=(200.0, 100.0), obstacles=[Rectangle((150.0, 10.0), (180.0, 30.0))])
    water = Advection(domain=domain)
    return mission(water=water, vehicle=Unicycle(start=(40.0, 80.0))).environment("rgb_array")


def test_a_picture_shows_field_obstacle_and_vehicle_where_they_are(environment):
    environment.reset(seed=0)
    image = environment.render()
    assert image.shape == (SIDE // 2, SIDE, 3)
    assert image.dtype == np.uint8
    row, column = where(image, VEHICLE)
    assert (row, column) == pytest.approx((40, 80), abs=8)  # y = 80 of 100 is a fifth from the top
    assert where(image, OBSTACLE) == pytest.approx((159.5, 329.5), abs=1)
    darkness = 255 - image[..., 0].astype(float)
    assert darkness[100, 100] > darkness[10, 390] + 100  # the feature's centre is (50, 50)


def test_a_picture_follows_the_vehicle(environment):
    environment.reset(seed=0)
    before = where(environment.render(), VEHICLE)
    environment.step(0)
    environment.step(0)  # the vehicle covers its newest sample
    after = environment.render()
    assert where(after, VEHICLE)[1] > before[1] + 10
    assert ((after == (34, 34, 34)).all(axis=-1)).any()  # its sample


def test_gymnasium_finds_nothing_to_say_of_pictures():
    made = gymnasium.make("fieldrl/Advection-v0", render_mode="rgb_array")
    check_env(made.unwrapped, skip_render_check=True)
    made.reset(seed=0)
    assert made.render().shape == (SIDE, SIDE, 3)


def test_without_a_mode_there_is_no_picture(mission):
    environment = mission().environment()
    environment.reset()
    assert environment.render() is None


def test_an_unknown_mode_is_refused(mission):
    with pytest.raises(FieldrlError, match="render_mode"):
        mission().environment("ansi")


class Pyplot:
    """Stands for matplotlib.pyplot with a window."""

    def __init__(self):
        self.images, self.closed = [], False

    def get_backend(self):
        return "TkAgg"

    def figure(self, name):
        return self

    def add_axes(self, where):
        return self

    def set_axis_off(self):
        pass

    def imshow(self, image):
        return self

    def set_data(self, image):
        self.images.append(image)

    def show(self, block):
        assert not block

    def pause(self, seconds):
        assert seconds > 0

    def close(self, figure):
        self.closed = True


def test_for_people_every_step_is_shown_in_a_window(mission):
    pyplot, environment = Pyplot(), mission().environment("human")
    environment.window = Window(pyplot)
    environment.reset(seed=0)
    environment.step(0)
    environment.step(0)
    assert len(pyplot.images) == 3
    assert not np.array_equal(*pyplot.images[1:])
    environment.close()
    assert pyplot.closed


def test_without_windows_the_way_out_is_told(mission, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    import matplotlib as mpl

    mpl.use("agg")
    with pytest.raises(FieldrlError, match="rgb_array"):
        mission().environment("human").reset()
