"""The short form of ``python -m pipelines.faults``: nothing is lost, and results are the same to the bit."""

from __future__ import annotations

import pytest

from pipelines.faults import __main__ as faults
from pipelines.faults.bench import Bench
from pipelines.faults.fuzz_workers import without_figures

SHORT = [name for name, (_, _, _, few) in faults.CASES.items() if few]


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Bench:
    faults.warm()
    return Bench(tmp_path_factory.mktemp("faults"))


@pytest.mark.slow
@pytest.mark.parametrize("name", SHORT)
def test_a_run_survives(bench, name):
    _, case, _, few = faults.CASES[name]
    with without_figures():  # what is compared are records and summaries
        outcome = case(bench, few)
    assert outcome.trouble == []
    assert outcome.same >= few
    assert outcome.lost == 0
    assert outcome.lines <= 3, outcome.said
