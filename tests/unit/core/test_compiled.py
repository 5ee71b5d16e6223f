"""Compiled loops that allocate nothing."""

from __future__ import annotations

import numpy as np
import pytest
from numba.core.errors import NumbaError

from fieldrl.core.compiled import loop


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
