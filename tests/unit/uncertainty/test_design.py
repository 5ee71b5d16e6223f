"""Greedy D-optimal design, beside every set that there is."""

from itertools import combinations

import numpy as np
import pytest

from fieldrl.core.streams import stream
from fieldrl.uncertainty import design
from fieldrl.uncertainty.fisher import axes


@pytest.fixture(params=range(5))
def problem(request):
    """Information of 4 samples of 3 unknowns, and sensitivities of 12 candidates."""
    rng = stream(request.param, "design of a test")
    samples, candidates = rng.normal(0, 3, (4, 3)), rng.normal(0, 3, (12, 3))
    return samples.T @ samples, candidates


def total(information, slopes):
    """1/2 log det(I + F) after some samples."""
    known = np.eye(len(information)) + information
    return 0.5 * np.linalg.slogdet(known + slopes.T @ slopes).logabsdet


def test_each_choice_is_the_best_of_all_that_are_left(problem):
    information, slopes = problem
    chosen, gains = design.greedy(information, slopes, 4)
    for k in range(4):
        before = total(information, slopes[chosen[:k]])
        each = [
            total(information, slopes[[*chosen[:k], i]]) if i not in chosen[:k] else -np.inf
            for i in range(12)
        ]
        assert chosen[k] == np.argmax(each)
        assert gains[k] == pytest.approx(max(each) - before)


def test_a_greedy_set_is_as_good_as_submodularity_promises_and_one_alone_is_the_best(problem):
    information, slopes = problem
    nothing = total(information, slopes[:0])
    for count in (1, 2, 3):
        _, gains = design.greedy(information, slopes, count)
        best = max(total(information, slopes[list(those)]) for those in combinations(range(12), count))
        least = 1 - 1 / np.e if count > 1 else 1 - 1e-9
        assert least * (best - nothing) <= gains.sum() <= best - nothing + 1e-9


def test_what_is_excluded_is_not_taken_and_none_is_taken_twice(problem):
    information, slopes = problem
    chosen, _ = design.greedy(information, slopes, 12)
    assert sorted(chosen) == list(range(12))
    apart, _ = design.greedy(information, slopes, 12, lambda i: np.arange(12) // 3 == i // 3)
    assert sorted(apart // 3) == [0, 1, 2, 3]


def test_expected_std_is_that_of_all_samples_together(problem):
    information, slopes = problem
    found = design.expected_std(information, slopes[:2])
    for k in range(3):
        covariance = np.linalg.inv(information + slopes[:k].T @ slopes[:k])
        assert found[k] == pytest.approx(np.sqrt(np.diag(covariance)))
    assert np.all(np.diff(found, axis=0) < 0)


def test_a_direction_that_is_not_told_has_no_information_until_a_sample_tells_it():
    found = design.information_of(axes(np.array([[2.0, 0.0], [1.0, 0.0]])))
    assert found == pytest.approx(np.diag([5.0, 0.0]))
    std = design.expected_std(found, np.array([[0.0, 4.0]]))
    assert std[0] == pytest.approx([5**-0.5, np.inf])
    assert std[1] == pytest.approx([5**-0.5, 0.25])
