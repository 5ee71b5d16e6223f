"""Samples: frozen, appended to, left out one by one."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldrl.core.samples import Samples

number = st.floats(-1e6, 1e6)
rows = st.lists(st.tuples(number, number, number, number), max_size=12)


def built(rows):
    """Samples appended row by row (x, y, t, value)."""
    samples = Samples.none()
    for x, y, t, value in rows:
        samples = samples.append((x, y), t, value)
    return samples


def columns(samples):
    return np.column_stack([samples.positions, samples.times, samples.values])


@given(rows)
def test_appending_one_by_one_gives_the_same_as_all_at_once(rows):
    table = np.array(rows).reshape(-1, 4)
    samples = built(rows)
    assert np.array_equal(columns(samples), table)
    assert np.array_equal(columns(Samples.of(table[:, :2], table[:, 2], table[:, 3])), table)
    assert len(samples) == len(rows)


@given(rows.filter(len), st.data())
def test_leaving_one_out_keeps_all_others_in_order(rows, data):
    i = data.draw(st.integers(0, len(rows) - 1))
    assert np.array_equal(columns(built(rows).without(i)), np.delete(np.array(rows), i, axis=0))


@given(rows)
def test_appending_leaves_the_old_samples_alone(rows):
    samples = built(rows)
    before = columns(samples).copy()
    longer = samples.append((1, 2), 3, 4)
    longer.positions[:] = 0
    assert np.array_equal(columns(samples), before)


def test_samples_are_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Samples.none().values = np.zeros(3)  # type: ignore[misc]


def test_arrays_are_contiguous_floats_whatever_came_in():
    samples = Samples.of([[1, 2], [3, 4]], np.arange(4)[::2], [5, 6])
    for array in (samples.positions, samples.times, samples.values):
        assert array.dtype == np.float64
        assert array.flags.c_contiguous


def test_lengths_that_disagree_are_refused():
    with pytest.raises(ValueError, match="differ in length: 2, 1, 2"):
        Samples.of([[1, 2], [3, 4]], [0], [5, 6])


def test_what_is_stated_of_each_value_stays_with_it():
    samples = Samples.of(np.zeros((3, 2)), [1, 2, 3], [4, 5, 6], std=[0.1, 0.2, 0.3], censored=[0, 1, 0])
    chosen = samples.without(0)
    assert np.array_equal(chosen.std, [0.2, 0.3])
    assert np.array_equal(chosen.censored, [True, False])


def test_one_standard_deviation_serves_all_samples():
    assert np.array_equal(Samples.of(np.zeros((2, 2)), [1, 2], [4, 5], std=0.5).std, [0.5, 0.5])


@pytest.mark.parametrize("std", [0.0, -1.0, np.nan, np.inf, [1.0, 0.0]])
def test_a_standard_deviation_that_is_none_is_refused(std):
    with pytest.raises(ValueError, match="must be > 0"):
        Samples.of(np.zeros((2, 2)), [1, 2], [4, 5], std=std)


def test_columns_that_may_not_be_written_to_are_copied():
    values = np.arange(3.0)
    values.flags.writeable = False
    samples = Samples.of(np.zeros((3, 2)), values, values)
    assert samples.values.flags.writeable
    assert samples.times.flags.writeable
    np.testing.assert_array_equal(samples.values, values)
