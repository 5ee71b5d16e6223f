"""The statistics of a calibration, on intervals that are known to be right or wrong."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import norm

from pipelines.calibration import evidence
from pipelines.calibration.cases import LEVELS


def rows(std=1.0, told=1.0, count=2000, seed=0):
    """Missions whose estimates scatter by ``std`` while their intervals say ``told``."""
    off = std * np.random.default_rng(seed).standard_normal((count, 2))
    reach = [norm.ppf(0.5 + level / 2) * told for level in LEVELS]
    return [
        {
            "estimate": (0.3 + one).tolist(),
            "truth": [0.3, 0.3],
            "bound": [1.0, 1.0],
            "covered": [(np.abs(one) < end).tolist() for end in reach],
            "region": [True, True, bool(np.abs(one).max() < 9.0)],
            "surpassed": False,
            "rank": ndtr(one / told).tolist(),
            "p": float(2 * ndtr(-np.abs(one[0]))),
        }
        for one in off
    ]


def test_true_intervals_are_within_their_bands():
    right = rows()
    assert all(share.inside for share in evidence.coverage(right, "covered"))
    assert evidence.uniform(right) > 0.05
    found = evidence.efficiency(right)
    assert found.low < 1.0 < found.high
    assert found.gross == 0.0


def test_intervals_that_are_a_tenth_too_narrow_are_found_out():
    wrong = rows(told=0.9)
    assert not any(share.inside for share in evidence.coverage(wrong, "covered"))
    assert evidence.uniform(wrong) < 0.01


def test_what_the_luck_of_the_noise_did_is_taken_off():
    unlucky = [row | {"straight": row["covered"]} for row in rows(std=1.1)]
    assert not any(share.inside for share in evidence.coverage(unlucky, "covered"))
    assert all(share.inside for share in evidence.against_straight(unlucky))
    narrow = [row | {"straight": right["covered"]} for row, right in zip(rows(told=0.9), rows(), strict=True)]
    assert not any(share.inside for share in evidence.against_straight(narrow))


def test_samples_needed_are_counted_to_the_first_narrow_interval():
    tried = [{"widest": [3.0, 0.9, 2.0], "held": [[True], [i > 0], [True]]} for i in range(10)]
    found = evidence.needed([*tried, {"widest": [3.0] * 3, "held": [[True]] * 3}], 1.0)
    assert (found.median, found.stopped) == (2.0, 10 / 11)
    assert found.held.found[0] == 0.9
    assert evidence.needed(tried, 0.5).median == np.inf


def test_a_band_of_the_field_that_is_nowhere_wide_is_not_looked_at():
    told = [{"field": [1.0, None, 0.0], "field rms": [0.0, 0.0]}]
    assert evidence.band([*told, {}]) is None
    found = evidence.band([*told, {"field": [1.0, 0.9, 0.2], "field rms": [0.5, 1.0]}])
    assert (found.count, found.held, found.ratio) == (1, 0.9, 0.5)


def test_one_unknown_out_of_its_band_is_enough():
    hits = np.ones((400, 2))
    hits[:20, 0] = 0.0
    assert not evidence.share(hits, 0.95).inside  # 95 % and 100 %
    assert evidence.share(hits[:, :1], 0.95).inside


def test_a_gross_error_shows_in_the_ratio_and_not_in_the_others():
    some = rows(count=500)
    some[0]["estimate"] = [100.3, 0.3]
    found = evidence.efficiency(some)
    assert found.gross == pytest.approx(1 / 500)
    assert found.held == 1.0
    assert found.ratio > 3.0
    assert found.rest == pytest.approx(1.0, abs=0.05)


def test_false_alarms_of_p_values_that_are_uniform_are_five_per_cent():
    assert evidence.false_alarms(rows()).inside
    assert not evidence.false_alarms(rows(std=1.3)).inside


def test_power_is_told_from_the_class_on_where_nine_of_ten_are_called_wrong():
    sizes = np.linspace(0.0, 2.0, 201)
    tried = [{"wrong source": [float(size), 0.5 if size < 1.1 else 0.001]} for size in sizes]
    found = evidence.power([*tried, {}], "source")
    assert found.count == 201
    assert found.told == pytest.approx(91 / 201)
    assert found.size == pytest.approx(1.19)  # in the class from 1.02 to 1.18 nine of seventeen are
    assert found.power == 1.0
    assert found.large == pytest.approx(82 / 201)


def test_missions_with_misfits_of_all_sizes_are_judged():
    tried = [{"wrong source": [10.0**k, 0.001]} for k in range(-10, 10)]
    assert [told for *_, told in evidence.power_by_size(tried, "source")] == [1.0, 1.0]
    assert evidence.power(tried, "source").large == 1.0


def test_a_model_that_is_never_called_wrong_has_no_size_from_which_it_is():
    tried = [{"wrong source": [1.1, 0.5]} for _ in range(20)]
    assert evidence.power(tried, "source").size == np.inf
