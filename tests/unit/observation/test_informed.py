"""What the vehicle knows, as numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fieldrl.core.samples import Samples
from fieldrl.observation.informed import Informed
from fieldrl.observation.knowledge import Known
from fieldrl.observation.paper import Paper
from fieldrl.pde.advection import Advection

MODEL = Advection()
LOW, HIGH = np.array([0.0, 0.0, -math.pi, 0.0]), np.array([200.0, 200.0, math.pi, 20.0])
THETA = np.array([3.0, 6.0])
TWO = Samples.of([[60.0, 70.0], [90.0, 40.0]], [1.0, 2.0], [70.0, 20.0])
NONE = Known(MODEL, Samples.none(), np.zeros(2), 1.0)


def test_the_paper_s_agent_sees_its_own_state_alone():
    own = np.array([1.0, 2.0, 0.5, 3.0])
    assert Paper().see(own, NONE) is own
    assert Paper().bounds(LOW, HIGH, MODEL) == (LOW, HIGH)


def test_before_the_first_sample_only_the_bounds_are_known():
    seen = Informed().see(np.array([20.0, 50.0, 0.0, 0.0]), NONE)
    assert seen.tolist() == [20, 50, 0, 0, 0, 0, 30, 0, 30, 0, 40 / 70, 0, 1, 0, 1]


def test_the_feature_is_predicted_where_the_estimate_s_flow_has_carried_it():
    heading = math.pi / 2
    seen = Informed().see(np.array([56.0, 52.0, heading, 2.0]), Known(MODEL, TWO, THETA, 1.0))
    assert seen[4] == 20.0
    assert seen[6:8] == pytest.approx([0.0, 10.0])
    assert seen[8:11] == pytest.approx([10.0, 0.0, 0.8], abs=1e-12)
    behind = Informed().see(np.array([56.0, 52.0, -heading, 2.0]), Known(MODEL, TWO, THETA, 1.0))
    assert abs(behind[9]) == pytest.approx(math.pi)


def test_deviations_are_those_of_the_fisher_information():
    seen = Informed().see(np.array([56.0, 52.0, 0.0, 2.0]), Known(MODEL, TWO, THETA, 2.0))
    slopes = MODEL.jacobian(THETA[None], TWO.positions, TWO.times)[0] * 15.0 / 2.0
    variances = np.linalg.inv(np.eye(2) + slopes.T @ slopes)
    assert seen[11::2] == pytest.approx(THETA / 15.0)
    assert seen[12::2] == pytest.approx(np.sqrt(np.diag(variances)))
    assert seen[5] == pytest.approx(0.5 * np.log10(np.trace(variances) / 2))


def test_an_observation_lies_within_its_bounds():
    low, high = Informed().bounds(LOW, HIGH, MODEL)
    seen = Informed().see(np.array([56.0, 52.0, 0.0, 2.0]), Known(MODEL, TWO, THETA, 1.0))
    assert len(low) == len(high) == len(seen) == 15
    assert np.all((low <= seen) & (seen <= high))
