"""Named random streams depend on seed, name and indices, and on nothing else."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fieldrl.core.streams import stream

names = st.text(min_size=1, max_size=12)
indices = st.lists(st.integers(0, 1000), max_size=3)


@given(st.integers(0, 2**31), names, indices)
def test_the_same_name_gives_the_same_stream(seed, name, where):
    assert np.array_equal(stream(seed, name, *where).random(4), stream(seed, name, *where).random(4))


def test_seed_name_and_each_index_all_matter():
    keys = [
        (0, "sensor"),
        (1, "sensor"),
        (0, "agent"),
        (0, "sensor", 0),
        (0, "sensor", 1),
        (0, "sensor", 0, 0),
    ]
    draws = [tuple(stream(*key).random(4)) for key in keys]
    assert len(set(draws)) == len(keys)


def test_streams_of_one_seed_are_uncorrelated():
    draws = np.array([stream(0, "sensor", i).standard_normal(4000) for i in range(5)])
    assert np.allclose(np.corrcoef(draws), np.eye(5), atol=0.06)


def test_a_stream_is_the_same_on_every_machine():
    assert stream(0, "sensor", 3).integers(1_000_000, size=3).tolist() == [961434, 576997, 351416]
