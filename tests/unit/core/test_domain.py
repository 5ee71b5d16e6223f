"""The domain: walls and edges are water, obstacles are not; grids."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldrl.core.checks import InvalidValue
from fieldrl.core.domain import Circle, Domain, Rectangle

coordinate = st.floats(-50, 250)
size = st.floats(0.1, 60)
points = st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=20).map(np.array)
rectangles = st.builds(
    lambda x, y, w, h: Rectangle((x, y), (x + w, y + h)), coordinate, coordinate, size, size
)
circles = st.builds(lambda x, y, r: Circle((x, y), r), coordinate, coordinate, size)
obstacles = st.lists(st.one_of(rectangles, circles), max_size=4)


@settings(deadline=None)
@given(obstacles, points)
def test_water_is_the_rectangle_less_its_obstacles(shapes, positions):
    domain = Domain((0, 0), (200, 100), shapes)
    inside = np.all((positions >= 0) & (positions <= [200, 100]), axis=1)
    land = np.zeros(len(positions), dtype=bool)
    for shape in shapes:
        land |= shape.contains(positions)
    assert np.array_equal(domain.contains(positions), inside & ~land)


@settings(deadline=None)
@given(obstacles, points)
def test_more_obstacles_never_make_more_water(shapes, positions):
    fewer, more = Domain(obstacles=shapes[:-1]), Domain(obstacles=shapes)
    assert not np.any(more.contains(positions) & ~fewer.contains(positions))


@settings(deadline=None)
@given(obstacles, points)
def test_one_position_is_judged_as_among_many(shapes, positions):
    domain = Domain(obstacles=shapes)
    assert [bool(domain.contains(position)) for position in positions] == domain.contains(positions).tolist()


def test_walls_corners_and_edges_are_water():
    domain = Domain((0, 0), (10, 10), (Rectangle((2, 2), (4, 4)), Circle((7, 7), 2)))
    assert domain.contains(np.array([(0, 0), (10, 10), (0, 5), (2, 3), (4, 4), (5, 7), (7, 9)])).all()
    assert not domain.contains(np.array([(3, 3), (7, 7), (7, 8.9), (-1e-9, 5), (5, 10.0001)])).any()


def test_what_is_no_position_is_not_in_the_water():
    assert not Domain().contains(np.array([np.nan, 5.0]))


def test_a_domain_is_hashable_and_equal_to_its_twin():
    twins = [Domain([0, 0], [10, 10], [Circle([5, 5], 1), Rectangle([1, 1], [2, 2])]) for _ in range(2)]
    assert twins[0] == twins[1]
    assert hash(twins[0]) == hash(twins[1])


def test_no_obstacles_may_be_written_as_none():
    assert Domain(obstacles=None) == Domain()


@given(st.integers(1, 12), st.integers(1, 12))
def test_a_grid_holds_the_centres_of_equal_cells(nx, ny):
    grid = Domain((10, 20), (40, 26)).grid(nx, ny)
    assert np.allclose(grid.x, 10 + 30 / nx * (np.arange(nx) + 0.5))
    assert np.allclose(grid.y, 20 + 6 / ny * (np.arange(ny) + 0.5))
    assert grid.points.shape == (nx * ny, 2)
    assert np.array_equal(grid.points.reshape(nx, ny, 2)[:, 0, 0], grid.x)
    assert np.array_equal(grid.points.reshape(nx, ny, 2)[0, :, 1], grid.y)


@pytest.mark.parametrize(
    ("build", "key"),
    [
        (lambda: Domain((0, 0), (0, 10)), "upper"),
        (lambda: Domain((0, 0), (10, -10)), "upper"),
        (lambda: Domain((0,), (10, 10)), "lower"),
        (lambda: Domain((0, np.nan), (10, 10)), "lower"),
        (lambda: Domain((0, 0), "far"), "upper"),
        (lambda: Domain(obstacles="rock"), "obstacles"),
        (lambda: Domain(obstacles=5), "obstacles"),
        (lambda: Domain(obstacles=[(1, 2)]), "obstacles"),
        (lambda: Rectangle((1, 1), (1, 2)), "upper"),
        (lambda: Circle((1, 1), 0), "radius"),
        (lambda: Circle((1, 1), -1), "radius"),
        (lambda: Circle((1,), 1), "centre"),
    ],
)
def test_impossible_shapes_are_refused_by_name(build, key):
    with pytest.raises(InvalidValue) as error:
        build()
    assert error.value.key == key
