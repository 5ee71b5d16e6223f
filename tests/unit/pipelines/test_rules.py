import numpy as np
import pytest

from pipelines import rules
from pipelines.rules import Outcome, Verdict, verdict

YES, PARTLY, NO, UNCLEAR = Outcome.YES, Outcome.PARTLY, Outcome.NO, Outcome.UNCLEAR


@pytest.mark.parametrize(
    ("outcomes", "expected"),
    [
        ([YES, YES], Verdict.REPRODUCED),
        ([YES, NO], Verdict.PARTLY),
        ([YES, UNCLEAR], Verdict.PARTLY),
        ([PARTLY, PARTLY], Verdict.PARTLY),
        ([PARTLY, NO], Verdict.PARTLY),
        ([NO, NO], Verdict.NOT),
        ([NO, UNCLEAR], Verdict.UNKNOWN),
        ([UNCLEAR], Verdict.UNKNOWN),
    ],
)
def test_the_verdict_follows_from_the_findings(outcomes, expected):
    assert verdict(outcomes) is expected


@pytest.mark.parametrize(("middle", "expected"), [(2.1, YES), (1.85, YES), (2.4, PARTLY), (3.0, NO)])
def test_a_value_is_judged_by_the_distance_of_the_median(middle, expected):
    assert rules.value([0.0, middle, 100.0], 2.0) is expected


@pytest.mark.parametrize(("errors", "expected"), [([1, 2, 9, 9], YES), ([1, 9, 9, 9], PARTLY), ([9, 9], NO)])
def test_an_accuracy_is_judged_by_the_share_of_replicates_that_reach_it(errors, expected):
    assert rules.accuracy(errors, 2) is expected


def test_a_trend_needs_its_sign_in_nearly_all_replicates_and_a_size():
    low = np.full(8, 10.0)
    assert rules.trend(low, low - 2, -1) is YES
    assert rules.trend(low, low - 2, 1) is NO
    assert rules.trend(low, low - 0.1, -1) is NO  # too small to be one
    mixed = low + np.array([-4, 4, -4, 4, -4, 4, -4, 4])
    assert rules.trend(low, mixed, -1) is UNCLEAR


def test_two_replicates_never_confirm_a_trend():
    assert rules.trend([10.0, 10.0], [20.0, 20.0], 1) is UNCLEAR


def test_sameness_is_judged_by_the_quartiles_of_the_difference():
    low = np.full(8, 10.0)
    assert rules.sameness(low, low + 0.5) is YES
    assert rules.sameness(low, low + 5) is NO
    assert rules.sameness(low, low + np.array([-4, 4] * 4)) is UNCLEAR


def test_episodes_are_compared_either_way_and_not_when_there_are_few():
    low, high = np.arange(10.0), np.arange(10.0) + 20
    assert rules.episodes(low, high) is YES
    assert rules.episodes(high, low) is NO
    assert rules.episodes(low, low) is UNCLEAR
    assert rules.episodes(low[:4], high) is UNCLEAR


def test_the_best_episode_tells_nothing_unless_one_half_of_the_run_is_favoured():
    assert rules.chance([3, 7, 4, 9, 1, 5, 4, 1], 10, 7) is UNCLEAR
    assert rules.chance([6, 7, 8, 9, 10, 7, 7, 8], 10, 7) is YES
    assert rules.chance([1, 2, 3, 4, 5, 1, 1, 2], 10, 7) is NO


def test_shares_and_definitions():
    assert [rules.share([x]) for x in (0.9, 0.6, 0.2)] == [YES, PARTLY, NO]
    assert rules.definition(0.871, 0.75) is NO
    assert rules.definition(0.7501, 0.75) is YES
