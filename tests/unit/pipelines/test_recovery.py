"""Unknowns of every kind are found again: a few truths of each, and how trials are judged."""

from __future__ import annotations

import pytest

from pipelines.benchmarks import recovery

RIGHT = {
    "errors": [1.0, 2.9],
    "identified": [True, True],
    "held": [True, True],
    "several": False,
    "solves": 9,
}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, "within"),
        ({"errors": [1.0, 3.1]}, "told"),  # its interval holds the truth
        ({"errors": [1.0, 3.1], "held": [True, False]}, "silent"),
        ({"errors": [1.0, 3.1], "held": [False, False], "identified": [True, False]}, "told"),
        ({"errors": [9.0, 3.1], "held": [False, False], "identified": [True, False]}, "silent"),
        ({"errors": [9.0, 9.0], "held": [False, False], "several": True}, "told"),
        ({"errors": [float("nan"), 0.0], "held": [False, False]}, "silent"),
    ],
)
def test_a_trial_is_within_told_or_silent(change, expected):
    assert recovery.verdict_on(RIGHT | change) == expected


def test_the_row_counts_them():
    trials = [RIGHT] * 3 + [RIGHT | {"errors": [4.0, 0.0], "held": [False, True]}]
    assert recovery.row(("advection", "flow"), trials) == [
        "advection", "flow", "2", "100 %", "75.0 %", "0", "1 (at most 4.0)", "0.0", "87.5 %", "9",
    ]  # fmt: skip


KINDS = [name for name in recovery.kinds() if name[0] == "advection"] + [
    ("double_gyre", kind) for kind in ("flow uniform", "diffusivity", "amplitude")
]


@pytest.mark.parametrize("name", KINDS, ids=" ".join)
def test_unknowns_of_every_kind_are_found_again(name, tmp_path):
    model = recovery.kinds(tmp_path)[name]()
    count = 2 if name[0] == "double_gyre" or name[1] == "six together" else 10
    verdicts = [recovery.verdict_on(recovery.tried(model, name, number)) for number in range(count)]
    kinked = name[1] == "times of the source"  # see docs/unknowns.md
    assert verdicts.count("within") >= count - (3 if kinked else 1)
    assert "silent" not in verdicts
