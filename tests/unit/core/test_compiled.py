"""Compiled loops that allocate nothing, and word of their compilation."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from numba.core.errors import NumbaError

from fieldrl.core.compiled import loop, told


def test_a_loop_works_on_the_arrays_it_is_given():
    @loop
    def double(values):
        for i in range(values.size):
            values[i] *= 2.0

    values = np.arange(3.0)
    double(values)
    np.testing.assert_array_equal(values, [0.0, 2.0, 4.0])


def test_a_loop_that_allocates_is_refused():
    @loop
    def allocate(n):
        return np.zeros(n).sum()

    with pytest.raises(NumbaError):
        allocate(3)


def test_compilation_is_told_once_and_only_of_our_own_loops():
    def add(a, b):
        return a + b

    said = []
    with told(lambda: said.append("compiling")):
        njit(add)(1, 2)
        assert said == []
        add.__module__ = "fieldrl.somewhere"
        ours = njit(add)
        ours(1, 2)
        ours(1, 3)
        ours(1.0, 2.0)
    assert said == ["compiling"]
    ours(1, 2.0)
    assert said == ["compiling"]
