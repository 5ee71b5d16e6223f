import numpy as np
import pytest

from pipelines.paper import rules
from pipelines.paper.rules import Outcome, Verdict, judge, verdict

YES, NO, OPEN, UNSAID = Outcome.YES, Outcome.NO, Outcome.OPEN, Outcome.UNSAID
TEN = np.full(32, 10.0)
RNG = np.random.default_rng(0)
SPREAD = RNG.normal(size=32)


def outcome(finding):
    """Of a finding that stands alone."""
    return judge([finding])[0].outcome


@pytest.mark.parametrize(
    ("outcomes", "expected"),
    [
        ([YES, YES], Verdict.REPRODUCED),
        ([YES, NO], Verdict.NOT),
        ([OPEN, NO, UNSAID], Verdict.NOT),
        ([YES, OPEN], Verdict.OPEN),
        ([YES, UNSAID, OPEN], Verdict.UNSAID),
        ([UNSAID], Verdict.UNSAID),
    ],
)
def test_the_verdict_follows_from_the_findings(outcomes, expected):
    assert verdict(outcomes) is expected


def test_a_change_needs_its_sign_and_a_size_and_can_fail():
    noise = 0.2 * SPREAD
    assert outcome(rules.change("", TEN, TEN - 2 + noise, -1)) is YES
    assert outcome(rules.change("", TEN, TEN - 2 + noise, 1)) is NO
    assert outcome(rules.change("", TEN, TEN + noise, 1)) is NO  # nothing
    assert outcome(rules.change("", TEN, TEN + 0.2, 1)) is NO  # sure, but too little to matter
    assert outcome(rules.change("", TEN, TEN + 0.5 + 20 * SPREAD, 1)) is OPEN


def test_an_open_finding_tells_what_would_have_been_seen():
    judged = judge([rules.change("", TEN, TEN + 0.5 + 20 * SPREAD, 1)])[0]
    assert 1 < judged.smallest < 20
    assert f"smallest to be seen: {judged.smallest:.2g}" in judged.measured
    few = judge([rules.change("", TEN[:2], TEN[:2] + 9, 1)])[0]
    assert few.outcome is OPEN
    assert "too few replicates" in few.measured
    assert outcome(rules.change("", [], [], 1)) is OPEN


@pytest.mark.parametrize(("middle", "expected"), [(2.05, YES), (1.9, YES), (2.5, NO), (1.5, NO)])
def test_a_value_is_the_same_within_ten_percent(middle, expected):
    assert outcome(rules.value("", middle + 0.05 * SPREAD, 2.0)) is expected


def test_a_scattered_value_is_open():
    judged = judge([rules.value("", 2.0 + 3 * SPREAD, 2.0)])[0]
    assert judged.outcome is OPEN
    assert "smallest to be seen: ±" in judged.measured


def test_sameness_is_that_of_pairs():
    base = TEN + 5 * SPREAD
    assert outcome(rules.same("", base, base + 0.1 * RNG.normal(size=32))) is YES
    assert outcome(rules.same("", base, base + 3)) is NO
    assert outcome(rules.same("", base, base + 8 * RNG.normal(size=32))) is OPEN


def test_a_size_is_judged_by_its_bound():
    assert outcome(rules.small("", 1 + 0.1 * SPREAD, 2, "b")) is YES
    assert outcome(rules.small("", 3 + 0.1 * SPREAD, 2, "b")) is NO
    assert outcome(rules.small("", 2 + SPREAD - np.median(SPREAD), 2, "b")) is OPEN


def test_a_single_value_is_compared_with_the_whole_distribution():
    errors = np.arange(1.0, 101.0)
    half = rules.reached("", errors, 50.5, errors + 30)
    assert outcome(half) is YES
    assert half.numbers["percentile"] == 50
    assert "percentile 50 of ours, 20 of a random agent's" in half.measured
    assert outcome(rules.reached("", errors, 0.5)) is NO
    assert outcome(rules.reached("", errors, 5.5)) is OPEN


def test_one_lucky_replicate_of_twenty_confirms_nothing():
    assert outcome(rules.reached("", np.append(np.full(19, 9.0), 0.1), 1.0)) is OPEN


def test_facts_and_what_is_not_said():
    assert outcome(rules.fact("", "", True)) is YES
    assert outcome(rules.fact("", "", False)) is NO
    assert outcome(rules.unsaid("", "")) is UNSAID


def test_the_more_findings_the_more_each_of_them_must_show():
    rng, nothing = np.random.default_rng(3), rules.small("", TEN + SPREAD, 10.0 + np.median(SPREAD), "b")
    weak = np.concatenate([np.full(11, -1.0), np.full(21, 1.0)]) + 0.01 * rng.normal(size=32)
    alone = rules.small("", TEN - weak, 10.0, "b")
    assert judge([alone])[0].outcome is OPEN or judge([alone])[0].so < 0.06
    strong = rules.small("", TEN - np.abs(weak), 10.0, "b")
    together = judge([strong, alone, *[nothing] * 40])
    assert together[0].outcome is YES
    assert together[1].so > judge([alone])[0].so


def test_findings_without_chance_are_not_counted():
    finding = rules.change("", TEN, TEN - 2 + 0.2 * SPREAD, -1)
    facts = [rules.fact("", "", False)] * 50
    assert judge([finding, *facts])[0].so == judge([finding])[0].so


def test_values_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="finite"):
        rules.value("", [1.0, np.nan], 2.0)
