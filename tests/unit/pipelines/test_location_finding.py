"""The public yardstick: the task at values worked out by hand, its bounds where the information is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fieldrl.core.domain import Domain
from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from pipelines.benchmarks import location_finding, placing, sources
from pipelines.benchmarks.placing import STRATEGIES, Estimates, Jumps, expected_information
from pipelines.benchmarks.sources import Near, Sources, bounds

TIMES = np.zeros(3)
SENSORS = np.array([[0.0, 0.0], [3.0, 0.0], [1e6, 0.0]])
TWO = np.array(
    [[0.0, 0.0, 3.0, 4.0]]
)  # one source under the first sensor, the other 5 from it, 4 from the next
ALONE = {"measurements": 3, "contrasts": 500}


def test_a_sensor_reads_the_log_of_what_both_sources_send():
    by_hand = [
        math.log(0.1 + 10_000.0 + 1 / 25.0001),
        math.log(0.1 + 1 / 9.0001 + 1 / 16.0001),
        math.log(0.1),
    ]
    assert_allclose(sources.means(TWO, SENSORS)[0], by_hand, rtol=1e-9)
    assert_allclose(Sources().predict(sources.levels(TWO), SENSORS, TIMES)[0], by_hand, rtol=1e-9)


def test_levels_are_those_of_the_normal_distribution():
    z = np.linspace(-4.7, 4.7, 48).reshape(-1, 4)
    model, sensors = Sources(), np.array([[0.1, -0.3], [2.0, 1.0]])
    expected = sources.means(z, sensors)
    assert_allclose(model.predict(sources.levels(z), sensors, TIMES[:2]), expected, atol=1e-9)


def test_slopes_are_those_of_differences():
    z, step = np.array([[0.3, -0.8, 1.2, 0.1]]), 1e-6 * np.eye(4)
    model, theta = Sources(), sources.levels(z)
    differences = [
        (model.predict(theta + one, SENSORS, TIMES) - model.predict(theta - one, SENSORS, TIMES))[0] / 2e-6
        for one in step
    ]
    assert_allclose(model.jacobian(theta, SENSORS, TIMES)[0], np.transpose(differences), atol=1e-6)
    of_places = [
        (sources.means(z + one, SENSORS) - sources.means(z - one, SENSORS))[0] / 2e-6 for one in step
    ]
    assert_allclose(sources.slopes_at(z, SENSORS)[0], np.transpose(of_places), atol=1e-6)


def test_likelihoods_are_normal():
    z, values = stream(0, "z").standard_normal((5, 4)), np.array([1.0, 0.0, -2.0])
    expected = -0.5 * np.sum(((sources.means(z, SENSORS) - values) / 0.5) ** 2, axis=1)
    assert_allclose(sources.log_likelihoods(z, SENSORS, values), expected, rtol=1e-12)


@pytest.mark.parametrize("own", [False, True], ids=["contrasts of the prior", "contrasts of the posterior"])
def test_the_information_of_a_linear_measurement_lies_between_the_bounds(own):
    """Theta N(0, 1) measured with noise s tells log(1 + 1 / s^2) / 2; each roll-out beside its exact gain."""
    noise, count, rng = 0.3, 300, stream(1, "linear")
    off = []
    for _ in range(400):
        theta, y = (draw := rng.standard_normal(2))[0], draw[0] + noise * draw[1]
        middle, width = (y / (1 + noise**2), 1.5 * noise / math.sqrt(1 + noise**2)) if own else (0.0, 1.0)
        others = middle + width * rng.standard_normal(count)

        def log_weight(at, middle=middle, width=width):
            return -0.5 * at**2 + 0.5 * ((at - middle) / width) ** 2 + math.log(width)

        def log_likelihood(at, y=y):
            return -0.5 * ((y - at) / noise) ** 2

        found = bounds(log_likelihood(theta), log_likelihood(others) + log_weight(others), log_weight(theta))
        evidence = math.log(noise / math.hypot(1, noise)) - 0.5 * y**2 / (1 + noise**2)
        off.append(np.array(found) - (log_likelihood(theta) - evidence))
    below, above = np.mean(off, axis=0)
    error = np.std(off, axis=0)[1] / 20
    assert below < above
    assert -0.05 < below < 3 * error
    assert -3 * error < above < 0.05


def test_contrasts_of_the_prior_cannot_tell_more_than_the_log_of_their_number():
    lower, upper = bounds(0.0, np.full(500, -1000.0))
    assert lower == pytest.approx(math.log(501))
    assert upper == pytest.approx(1000.0)


def test_contrasts_nearby_are_weighted_to_the_prior():
    near, rng = Near(TWO, SENSORS), stream(2, "near")
    z = near.drawn(20_000, rng)
    weight = np.exp(near.log_weight(z))
    assert weight.mean() == pytest.approx(1.0, abs=0.03)
    assert (weight[:, None] * z**2).mean(axis=0) == pytest.approx(np.ones(4), abs=0.1)
    assert weight.max() <= 4.0  # a quarter is the prior


def test_both_pairs_of_bounds_agree_where_the_prior_has_enough_contrasts():
    truth, sensors = stream(3, "truth").standard_normal((1, 4)), stream(3, "sensors").standard_normal((6, 2))
    values = sources.means(truth, sensors)[0] + 0.5 * stream(3, "noise").standard_normal(6)
    found = location_finding.judged(Samples.of(sensors, np.arange(6.0), values), truth, 3, 300_000)
    assert found["sPCE"] <= found["sNMC"] == pytest.approx(found["sPCE"], abs=0.01)
    assert found["sACE"] <= found["sVNMC"] == pytest.approx(found["sACE"], abs=0.01)
    assert found["sACE"] == pytest.approx(found["sPCE"], abs=0.1)


def test_the_order_of_the_sources_does_not_count():
    assert sources.distance(TWO[0], TWO[0, [2, 3, 0, 1]]) == 0.0
    assert sources.distance(TWO[0], TWO[0] + [0.0, 0.0, 0.3, 0.4]) == pytest.approx(0.5 / math.sqrt(2))


def test_a_sample_that_tells_two_draws_apart_gains_log_2():
    mu = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 50.0]])
    nothing, some, everything = expected_information(mu)
    assert nothing == pytest.approx(0.0, abs=1e-12)
    assert 0.05 < some < 0.3
    assert everything == pytest.approx(math.log(2))


def test_the_greedy_agent_and_suggest_have_one_rule(monkeypatch):
    samples, estimates = some_samples(8), Estimates()
    grid = Domain((-4.0, -4.0), (4.0, 4.0)).grid(50, 50).points
    monkeypatch.setattr(placing, "candidates", lambda theta: grid)
    both = [
        STRATEGIES[name]()(samples, 1, stream(0, "choices")) for name in ("greedy_information", "suggest")
    ]
    assert np.array_equal(*both)
    near = sources.places(estimates.of(samples)).reshape(2, 2)
    assert np.linalg.norm(near - both[0], axis=1).min() < 0.3


def some_samples(count: int) -> Samples:
    sensors = placing.spread(count)
    return Samples.of(sensors, np.arange(1.0, count + 1), sources.means(TWO / 4, sensors)[0])


def test_a_vehicle_that_jumps_is_wherever_its_action_says():
    vehicle = Jumps(SENSORS)
    where = vehicle.paths(None, np.array([[2], [0]]), 0.0, None, np.zeros((5, 4)), None)
    assert where.shape == (5, 2, 1, 2)
    assert np.array_equal(where[3, :, 0], SENSORS[[2, 0]])


def test_a_fixed_design_covers_the_prior():
    where = placing.spread(200)
    assert np.array_equal(where[:30], placing.spread(30))
    assert_allclose(where.mean(axis=0), 0.0, atol=0.03)
    assert_allclose(where.std(axis=0), 1.0, atol=0.05)


@pytest.mark.parametrize("name", STRATEGIES)
def test_roll_outs_are_repeatable_bit_for_bit(name):
    used = STRATEGIES[name]()
    location_finding.rollout(used, 8, **ALONE)
    once, again = (
        location_finding.rollout(used, 7, **ALONE),
        location_finding.rollout(STRATEGIES[name](), 7, **ALONE),
    )
    assert {**once, "seconds": 0} == {**again, "seconds": 0}
    assert np.isfinite(list(once.values())).all()


@pytest.mark.parametrize(
    ("name", "count"),
    [("greedy_information", 2), ("suggest", 2), ("planner", 5), ("expected_information", 1)],
)
def test_who_seeks_information_gains_more_than_who_does_not(name, count):
    def gained(who):
        choose = STRATEGIES[who]()
        return np.mean([location_finding.rollout(choose, n, 8, 500)["sACE"] for n in range(count)])

    assert gained(name) > gained("random") + 1.0


def test_finished_roll_outs_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(location_finding, "KEPT", tmp_path)
    monkeypatch.setattr(location_finding, "PART", 2)
    some = location_finding.rollouts("random", 3, **ALONE, jobs=1)
    monkeypatch.setattr(location_finding, "STRATEGIES", {"random": lambda: placing.fixed})
    more = location_finding.rollouts("random", 4, **ALONE, jobs=1)
    assert more[:3] == some
    assert location_finding.rollouts("random", 3, **ALONE, jobs=1) == some


def test_the_table_has_means_with_standard_errors_and_the_published_lines():
    found = [
        dict.fromkeys(location_finding.BOUNDS, gain) | {"error": gain, "seconds": 0.5} for gain in (1.0, 3.0)
    ]
    assert location_finding.row("ours", found) == ("ours", "2", *["2.00 ± 1.00"] * 4, "2", "0.5")
    lines = location_finding.published()
    assert {len(line) for line in lines} == {len(location_finding.COLUMNS)}
    assert ("DAD [1]", "2048", "10.926 ± 0.036", "12.382 ± 0.095", "", "", "", "0.00158") in lines
