"""A slice of the fuzzer: hostile command lines end in a good message or run, and nothing is left behind."""

from __future__ import annotations

import pytest

from pipelines.faults import fuzz, fuzz_workers
from pipelines.faults.fuzz import Case, cases, judged
from pipelines.faults.fuzz_workers import Seen

SLICE = 25
CASE = Case(("experiment=advection",), ("pde.domain.upper=[1,2]",), alone=False)


def test_hostile_command_lines_are_refused_well_or_run():
    bad = [
        (case.arguments, verdict, seen.errors, seen.left)
        for case, seen, verdict in fuzz.measure(SLICE, seed=11, jobs=2)
        if verdict not in fuzz_workers.GOOD
    ]
    assert bad == []


def test_the_same_seed_gives_the_same_cases():
    assert list(cases(30, 3)) == list(cases(30, 3))
    assert list(cases(30, 3)) != list(cases(30, 4))


@pytest.mark.parametrize(
    ("seen", "verdict"),
    [
        (Seen(0), "ran"),
        (Seen(1, "pde.domain.upper=[1, 2]: must be more"), "refused"),
        (Seen(1, "the domain is too small"), "refused"),
        (Seen(1, "something is wrong"), "unclear"),
        (Seen(1, "pde.domain.upper\n2\n3\n4"), "unclear"),
        (Seen(1, "pde: Advection refuses these values: upper"), "unclear"),
        (Seen(1, "unexpected AttributeError: upper"), "unexpected"),
        (Seen(-11, "upper"), "unexpected"),
        (Seen(1, ""), "unexpected"),
        (Seen(1, "upper: no", left=["outputs"]), "leftovers"),
        (Seen(verdict="time-out"), "time-out"),
    ],
)
def test_what_was_seen_is_judged(seen, verdict):
    assert judged(CASE, seen) == verdict
