"""The sensor: what it draws, and with which spread."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldrl.core.checks import InvalidValue
from fieldrl.core.streams import stream
from fieldrl.vehicle.sensor import Sensor

STATE = np.array([10.0, 20.0, 0.5])
variance = st.floats(0, 100)


def test_a_perfect_sensor_returns_the_state_itself_and_draws_nothing():
    rng = stream(0, "sensor")
    assert Sensor().observe(STATE, rng) is STATE
    assert Sensor(noise=0).measure(3.5, rng) == 3.5
    assert rng.random() == stream(0, "sensor").random()


@settings(deadline=None)
@given(st.tuples(variance, variance, variance).filter(any), st.integers(0, 1000))
def test_the_measured_state_is_the_state_plus_scaled_normal_numbers(covariance, seed):
    measured = Sensor(covariance=covariance).observe(STATE, stream(seed, "sensor"))
    noise = stream(seed, "sensor").standard_normal(3)
    assert np.allclose(measured, STATE + np.sqrt(covariance) * noise)


@settings(deadline=None)
@given(st.floats(-1e6, 1e6), st.just(0.0) | st.floats(1e-30, 100), st.integers(0, 1000))
def test_a_sample_is_the_value_plus_noise_from_the_given_stream(value, noise, seed):
    sensor = Sensor(noise=noise)
    sample = sensor.measure(value, stream(seed, "sensor"))
    assert isinstance(sample, float)
    assert sample == pytest.approx(value + noise * stream(seed, "sensor").standard_normal())


def test_noise_has_the_configured_spread():
    rng, sensor = stream(1, "sensor"), Sensor(noise=2.0, covariance=(4.0, 9.0, 0.01))
    samples = np.array([sensor.measure(5.0, rng) for _ in range(20_000)])
    states = np.array([sensor.observe(STATE, rng) for _ in range(20_000)])
    assert samples.mean() == pytest.approx(5.0, abs=0.06)
    assert samples.std() == pytest.approx(2.0, rel=0.03)
    assert np.allclose(np.cov(states.T), np.diag([4.0, 9.0, 0.01]), atol=0.25, rtol=0.05)


@pytest.mark.parametrize(
    ("key", "value"),
    [("noise", -1), ("noise", "loud"), ("covariance", [1, 1]), ("covariance", [1, 1, -1]), ("covariance", 1)],
)
def test_bad_values_are_refused_by_name(key, value):
    with pytest.raises(InvalidValue) as error:
        Sensor(**{key: value})
    assert error.value.key == key
