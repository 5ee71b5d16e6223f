"""The number that jobs of a sweep are compared by."""

from __future__ import annotations

import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.sweeps.objective import Objective, known_paths

SUMMARY = {
    "e_total": 1.5,
    "late_e_total": [2.0, 4.0, 9.0],
    "theta_error": None,
    "greedy": [{"return": 1.0}, {"return": 3.0}],
    "parameters": {"mu": {"estimate": 0.25, "unit": "1"}},
}


@pytest.mark.parametrize(
    ("path", "values", "value"),
    [
        ("e_total", (1.5,), 1.5),
        ("late_e_total", (2.0, 4.0, 9.0), 4.0),
        ("greedy.return", (1.0, 3.0), 2.0),
        ("parameters.mu.estimate", (0.25,), 0.25),
        ("theta_error", (), None),
        ("parameters.mu.unit", (), None),
        ("parameters.nu.estimate", (), None),
    ],
)
def test_a_path_leads_to_numbers_whose_median_counts(path, values, value):
    objective = Objective(path, "minimise")
    assert objective.values(SUMMARY) == values
    assert objective.value(SUMMARY) == value


def test_less_is_better_or_worse():
    assert Objective("e_total", "minimise").loss(2.0) == 2.0
    assert Objective("e_total", "maximise").loss(2.0) == -2.0


def test_an_unknown_direction_is_refused():
    with pytest.raises(InvalidValue, match="direction=up"):
        Objective("e_total", "up")


def test_an_unknown_path_is_refused_with_those_that_there_are():
    known = known_paths(["mu"], true=True, greedy=False)
    Objective("pooled.parameters.mu.estimate", "minimise").check(known)
    with pytest.raises(InvalidValue, match=r"objective=etotal.*late_e_total"):
        Objective("etotal", "minimise").check(known)
    with pytest.raises(InvalidValue):
        Objective("greedy.return", "minimise").check(known)
