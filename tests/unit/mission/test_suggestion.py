"""Where to sample next: what is suggested, and whether it is worth more than chance."""

import numpy as np
import pytest

import fieldrl
from fieldrl.core.checks import FieldrlError
from fieldrl.core.domain import Circle, Domain
from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.figures.suggestions import suggestion_figure
from fieldrl.pde.advection import Advection

THETA = np.array([5.0, 4.0])
OBSTACLE = Circle((90.0, 110.0), 25.0)
WATER = Advection(domain=Domain(obstacles=(OBSTACLE,)))


def measured(rng, positions, times):
    """Values there, with noise of 1."""
    return WATER.predict(THETA[None], positions, times)[0] + rng.normal(0, 1, len(times))


def taken(seed):
    """Ten samples somewhere near the feature, in order of time."""
    rng = stream(seed, "samples of a test")
    times = np.sort(rng.uniform(1, 8, 10))
    positions = 50 + times[:, None] * THETA + rng.normal(0, 25, (10, 2))
    return Samples.of(positions, times, measured(rng, positions, times), 1.0)


@pytest.fixture(scope="module")
def found():
    return fieldrl.estimate(taken(0), WATER)


def test_the_best_place_is_the_one_that_brute_force_finds(found):
    x, y = np.meshgrid(np.arange(20.0, 200.0, 20.0), np.arange(20.0, 200.0, 20.0))
    grid = np.column_stack([x.ravel(), y.ravel()])
    grid = grid[WATER.domain.contains(grid)]
    suggested = fieldrl.suggest(found, count=2, times=9.0, places=grid)
    best, volume = grid[:2], np.inf
    for i in range(len(grid)):
        for j in range(i):
            places = np.concatenate([found.samples.positions, grid[[i, j]]])
            times = np.append(found.samples.times, [9.0, 9.0])
            slopes = WATER.jacobian(found.theta[None], places, times)[0]
            size = np.linalg.det(np.linalg.inv(slopes.T @ slopes))
            if size < volume:
                best, volume = grid[[i, j]], size
    assert sorted(suggested.positions.tolist()) == sorted(best.tolist())
    places = np.concatenate([found.samples.positions, suggested.positions])
    slopes = WATER.jacobian(found.theta[None], places, np.append(found.samples.times, [9.0, 9.0]))[0]
    for std, some in ((suggested.std[0], slopes[:-2]), (suggested.std[-1], slopes)):
        assert std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(some.T @ some))), rel=1e-6)
    assert suggested.std[0] == pytest.approx(list(found.std.values()), rel=0.01)


def test_samples_that_were_suggested_shrink_the_intervals_more_than_samples_by_chance():
    widths = {"suggested": [], "by chance": []}
    for seed in range(12):
        samples = taken(seed)
        before = fieldrl.estimate(samples, WATER)
        suggested = fieldrl.suggest(before, count=4, times=9.0)
        rng = stream(seed, "chance of a test")
        anywhere = rng.uniform(0, 200, (4, 2))
        for name, places in (("suggested", suggested.positions), ("by chance", anywhere)):
            values = measured(stream(seed, "noise of a test"), places, np.full(4, 9.0))
            more = Samples.of(
                np.concatenate([samples.positions, places]),
                np.append(samples.times, np.full(4, 9.0)),
                np.append(samples.values, values),
                1.0,
            )
            ends = np.array(list(fieldrl.estimate(more, WATER).intervals.values()))
            widths[name].append(np.prod(ends[:, 1] - ends[:, 0]))
    ratio = np.array(widths["suggested"]) / np.array(widths["by chance"])
    assert np.all(ratio < 1.0)
    assert np.median(ratio) < 0.6


def test_places_keep_out_of_obstacles_and_settings_are_kept_to(found):
    last = found.samples.positions[-1]
    suggested = fieldrl.suggest(found, count=6, times=[8.5, 9.0], reach=60.0, apart=15.0)
    assert WATER.domain.contains(suggested.positions).all()
    assert set(suggested.times) <= {8.5, 9.0}
    assert np.all(np.linalg.norm(suggested.positions - last, axis=1) <= 60.0)
    for time in (8.5, 9.0):
        at = suggested.positions[suggested.times == time]
        distance = np.linalg.norm(at[:, None] - at, axis=-1) + 1e9 * np.eye(len(at))
        assert np.all(distance >= 15.0)
    gain = suggested.map["gain"]
    points = np.stack(np.meshgrid(gain.x, gain.y, indexing="ij"), axis=-1)
    assert np.array_equal(np.isnan(gain[0]), ~WATER.domain.contains(points))
    assert "std_b_x" in str(suggested)


def test_the_picture_has_a_panel_for_each_time_and_a_number_for_each_sample(found):
    suggested = fieldrl.suggest(found, count=4, times=[8.5, 9.0], apart=100.0)
    drawn = suggestion_figure(suggested)
    panels = [axes for axes in drawn.axes if axes.get_title(loc="left")]
    assert len(panels) == len(set(suggested.times)) == 2
    assert sorted(text.get_text() for axes in panels for text in axes.texts) == ["1", "2", "3", "4"]


def test_a_model_of_ones_own_needs_no_domain_and_no_derivatives(found):
    class Plain:
        parameters = WATER.parameters

        def predict(self, theta, positions, times):
            return WATER.predict(theta, positions, times)

    own = fieldrl.estimate(taken(0), Plain())
    where = {"count": 3, "times": 9.0, "places": [[60, 60], [100, 80], [120, 60], [60, 120]]}
    suggested, exact = fieldrl.suggest(own, **where), fieldrl.suggest(found, **where)
    assert np.array_equal(suggested.positions, exact.positions)
    assert suggested.std[-1] == pytest.approx(exact.std[-1], rel=0.02)
    assert fieldrl.suggest(own, count=1).positions.shape == (1, 2)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"count": 0}, "count=0: must be >= 1"),
        ({"times": -1.0}, "times=.*must lie between 0 and"),
        ({"times": []}, "times=.*must lie between 0 and"),
        ({"reach": 1e-9}, "reach=1e-09: no place is so near"),
        ({"apart": -1.0}, "apart=-1"),
        ({"places": [[90.0, 110.0]]}, "none of 1 lies in the model's domain"),
        ({"places": [1.0, 2.0, 3.0]}, "must be finite positions"),
    ],
)
def test_what_is_refused_is_said(found, settings, said):
    with pytest.raises(FieldrlError, match=said):
        fieldrl.suggest(found, **settings)
