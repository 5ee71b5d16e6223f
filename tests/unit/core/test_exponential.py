"""Several exponentials at a time have the digits of the C library."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from fieldrl.core.exponential import exponential, exponentials


@njit
def many(x, result):
    exponentials(x, result)


@njit
def one_by_one(x, result):
    for i in range(x.size):
        result[i] = exponential(x[i])


@pytest.mark.parametrize("function", [many, one_by_one], ids=["many", "one by one"])
@pytest.mark.parametrize("reach", [1e-12, 1.0, 40.0, 512.0, 800.0])
def test_the_digits_are_those_of_the_c_library(function, reach):
    x = -reach * np.random.default_rng(0).uniform(size=20_000)
    found = np.empty_like(x)
    function(x, found)
    np.testing.assert_array_equal(found, [math.exp(each) for each in x.tolist()])


def test_the_ends_of_the_range_are_as_they_should_be():
    x, found = np.array([0.0, -0.0, -1e-300, -512.0, -745.2, -np.inf, np.nan]), np.empty(7)
    many(x, found)
    np.testing.assert_array_equal(found, [1.0, 1.0, 1.0, math.exp(-512.0), 0.0, 0.0, np.nan])
