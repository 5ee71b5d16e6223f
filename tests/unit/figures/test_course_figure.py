import base64
import json

import numpy as np
import pytest

from fieldrl.figures import course
from fieldrl.figures.moving import moving_course


@pytest.mark.parametrize(("steps", "panels"), [(2, 1), (6, 3), (10, 4), (20, 8), (40, 8)])
def test_panels_fill_whole_rows(make_record, steps, panels):
    record = make_record(steps=steps, episodes=2)

    drawing = course.course_figure(record)

    assert len(drawing.axes) == panels + 1  # and the colour bar


def test_each_panel_shows_the_path_up_to_its_sample(make_record):
    record = make_record(steps=20, episodes=2)

    axes = course.course_figure(record).axes[2]

    step = int(record["course_step"][round(2 * 9 / 7)])
    best = int(record["best_episode"][0])
    assert axes.get_title(loc="left") == f"sample {step + 1}, $t$ = {step + 1}"
    path = axes.lines[0].get_xydata()
    np.testing.assert_allclose(path[1:], record["position"][0, best, : step + 1])


def test_a_record_of_an_earlier_version_has_no_course(make_record):
    assert course.has_course(make_record())
    assert not course.has_course(make_record().drop_vars("field_course"))


def test_a_page_gets_every_cell_as_a_byte_and_unknown_numbers_as_null(make_record):
    record = make_record(steps=4, episodes=2)
    best = int(record["best_episode"][0])
    record["theta"][0, best, 0] = np.nan

    drawn = json.loads(json.dumps(moving_course(record), allow_nan=False))

    fields = np.frombuffer(base64.b64decode(drawn["fields"]), np.uint8)
    fields = fields.reshape(2, drawn["height"], drawn["width"])
    assert (fields.min(), fields.max()) == (0, 255)
    top = record["field_course"][0].values.T[::-1]
    assert np.unravel_index(fields[0].argmax(), fields[0].shape) == np.unravel_index(top.argmax(), top.shape)
    assert drawn["theta"][0] == [None, None]
    assert len(drawn["path"]) == 4
