"""What a result means, in sentences."""

from __future__ import annotations

from typing import Any

import pytest

from fieldrl.runs import meaning


def summary(**changes: Any) -> dict[str, Any]:
    parameters = {
        "mu": {"true": 0.25, "estimate": 0.24, "unit": "1"},
        "omega": {"true": 0.6283, "estimate": 0.63, "unit": "rad/time"},
    }
    pooled = {"parameters": {"mu": {"estimate": 0.2497}, "omega": {"estimate": 0.62871}}}
    known = {"parameters": parameters, "pooled": pooled, "best_episode": 2, "episodes": 10, "steps": 10}
    return known | {"replicates": 1} | changes


def with_intervals(mu: tuple[float, float], omega: tuple[float, float]) -> dict[str, Any]:
    found = summary()
    found["pooled"]["parameters"]["mu"]["interval"] = list(mu)
    found["pooled"]["parameters"]["omega"]["interval"] = list(omega)
    return found


def test_without_intervals_the_distance_to_the_truth_is_told():
    first, second = meaning.sentences(summary())
    assert first == "All 100 samples give mu = 0.2497 and omega = 0.6287 rad/time."
    assert second == "The true values are 0.25 and 0.6283: 0.0003 and 0.00041 away."


def test_intervals_decide_how_many_digits_are_shown():
    first, second = meaning.sentences(with_intervals((0.2488, 0.2506), (0.6269, 0.6305)))
    assert first == "All 100 samples give mu = 0.24970 ± 0.00090 and omega = 0.6287 ± 0.0018 rad/time (95 %)."
    assert second == "The true values are 0.25 and 0.6283, inside the intervals."


def test_a_truth_outside_is_named():
    *_, last = meaning.sentences(with_intervals((0.2488, 0.2498), (0.6269, 0.6305)))
    assert last == "The true values are 0.25 and 0.6283; mu lies outside."


def test_a_parameter_that_is_not_identified_is_told():
    found = with_intervals((0.0, 0.5), (0.6269, 0.6305))
    found["pooled"]["parameters"]["mu"]["identified"] = False
    assert meaning.sentences(found)[-1] == "These samples do not determine mu."


def test_the_verdict_is_told_without_repeating_the_intervals():
    found = with_intervals((0.2488, 0.2506), (0.6269, 0.6305))
    listed = "Told by the samples: mu = 0.2497 (0.2488 to 0.2506), omega = 0.6287 (0.6269 to 0.6305)."
    assert meaning.sentences(found | {"verdict": listed}) == meaning.sentences(found)
    *_, last = meaning.sentences(found | {"verdict": f"Two solutions fit. {listed} mu is at its bound."})
    assert last == "Two solutions fit. mu is at its bound."


def test_without_a_truth_nothing_is_said_of_it():
    found = summary()
    for parameter in found["parameters"].values():
        parameter["true"] = None
    assert len(meaning.sentences(found)) == 1


def test_where_no_pooled_estimate_is_known_the_best_episode_speaks():
    found = summary(pooled={"parameters": {"mu": {"estimate": None}, "omega": {"estimate": None}}})
    assert meaning.sentences(found)[0].startswith("The best episode (number 3 of 10) gives")


@pytest.mark.parametrize(
    ("value", "interval", "text"),
    [
        (0.63, (0.61, 0.72), "0.630 [0.610, 0.720]"),
        (5.0, None, "5"),
        (12345.6, (12000.0, 12700.0), "12346 ± 350"),
        (1.0, (1.0, 1.0), "1"),
        (1.0, (float("-inf"), 2.0), "1"),
        (1.0, (None, 2.0), "1"),
    ],
)
def test_numbers_have_the_digits_that_are_known(value, interval, text):
    assert meaning.rounded(value, interval) == text


def test_the_table_of_an_estimate_from_a_file_has_no_truth_and_no_episodes():
    found = summary(samples={"used": 30}, e_f=1.0, e_cv=2.0, e_total=3.0, theta_error=None, field_rmse=None)
    titles, rows = meaning.result_rows(found)
    assert titles == ["", "estimate"]
    assert rows[0] == ["mu [1]", "0.2497"]
    assert [label for label, _ in rows[2:]] == [
        "fit error e_f", "cross-validation error e_cv", "e_total = e_f + e_cv",
    ]  # fmt: skip
