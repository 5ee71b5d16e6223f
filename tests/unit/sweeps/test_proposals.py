"""Where the search tries next."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.sweeps.proposals import dependence, losses, propose
from fieldrl.sweeps.space import Dimension, Space

SQUARE = Space((Dimension("x", -1.0, 1.0), Dimension("y", 0.01, 1.0, log=True)), ())
MIXED = Space((Dimension("a", 1, 9, whole=True), Dimension("b", choices=("u", "v", "w"))), ())


def bowl(point) -> float:
    """Least, 0, at x = 0.3, y = 0.1."""
    return (point[0] - 0.3) ** 2 + 0.2 * (np.log10(point[1]) + 1) ** 2


def search(space, loss, count, batch=1, initial=6, seed=0, trials=()):
    trials = list(trials)
    while len(trials) < count:
        trials += [(point, loss(point)) for point in propose(space, trials, batch, initial, seed)]
    return trials


@pytest.fixture(scope="module")
def searched():
    """Eighteen trials of the bowl."""
    return search(SQUARE, bowl, 18)


def test_the_search_finds_a_minimum_that_a_random_search_misses(searched):
    found = min(loss for _, loss in searched)
    random = np.random.default_rng(0).uniform((-1, -2), (1, 0), (18, 2))
    assert found < 1e-3 < min(bowl((x, 10**y)) for x, y in random)


def test_a_search_that_is_continued_goes_where_an_uninterrupted_one_goes():
    whole = search(SQUARE, bowl, 10, batch=2)
    assert search(SQUARE, bowl, 10, batch=2, trials=whole[:6]) == whole


def test_another_seed_begins_elsewhere():
    assert propose(SQUARE, [], 3, 6, seed=0) != propose(SQUARE, [], 3, 6, seed=1)


def test_a_batch_does_not_reach_beyond_the_design_and_holds_different_points():
    assert len(propose(SQUARE, search(SQUARE, bowl, 5), 4, 6, 0)) == 1
    assert len(set(propose(SQUARE, search(SQUARE, bowl, 6), 4, 6, 0))) == 4


def test_nothing_is_tried_twice_and_the_search_ends_when_everything_has_been():
    space = Space((Dimension("b", choices=("u", "v")), Dimension("c", choices=("1", "2"), ordered=True)), ())
    trials: list = []
    while points := propose(space, trials, 3, 2, 0):
        trials += [(point, 1.0) for point in points]
    assert sorted(point for point, _ in trials) == [(0, 0), (0, 1), (1, 0), (1, 1)]


def test_values_are_inside_and_of_their_kind():
    for a, b in propose(MIXED, search(MIXED, lambda point: float(point[0]), 7), 3, 6, 0):
        assert isinstance(a, int)
        assert 1 <= a <= 9
        assert b in (0, 1, 2)


def test_a_failed_trial_counts_as_the_worst_of_the_others():
    assert losses([((0,), 1.0), ((1,), None), ((2,), 3.0)]).tolist() == [1.0, 3.0, 3.0]
    assert losses([((0,), None)]).tolist() == [0.0]


@pytest.mark.parametrize("loss", [lambda point: None, lambda point: 2.0])
def test_a_search_goes_on_where_everything_fails_or_is_equal(loss):
    assert len(search(SQUARE, loss, 8, batch=2, initial=2)) == 8


def test_the_dependence_on_a_key_has_its_minimum_where_the_function_has(searched):
    curves = dependence(SQUARE, searched, seed=0)
    for (places, mean), minimum in zip(curves, (0.3, 0.1), strict=True):
        assert places[int(np.argmin(mean))] == pytest.approx(minimum, abs=0.15)
