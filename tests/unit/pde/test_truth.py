"""The true field from another model than the one that is fitted."""

from dataclasses import replace

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.pde.advection import Advection
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.flow import DoubleGyre, UniformFlow
from fieldrl.pde.initial import InitialFeature

GYRE = AdvectionDiffusion(cells=(64, 32), final_time=2.0)
THETA = np.array([[0.25, 0.6]])
HERE, NOW = np.array([[60.0, 40.0], [90.0, 50.0]]), np.array([1.0, 2.0])


def test_without_changes_only_the_grid_differs():
    truth = GYRE.truth()
    assert truth.cells == (128, 64)
    assert replace(truth, cells=GYRE.cells, truth_refinement=GYRE.truth_refinement) == GYRE


def test_parts_of_components_and_plain_values_change_and_nothing_else():
    changes = {"diffusivity": 1.2, "order": 3, "flow": {"amplitude": 0.12}, "initial": {"scale": 24.0}}
    truth = replace(GYRE, true_model=changes).truth()
    assert (truth.diffusivity, truth.order) == (1.2, 3)
    assert truth.flow == replace(GYRE.flow, amplitude=0.12)
    assert truth.initial == replace(GYRE.initial, scale=24.0)
    assert (truth.domain, truth.courant, truth.true) == (GYRE.domain, GYRE.courant, GYRE.true)


def test_a_whole_component_may_take_another_s_place():
    feature = InitialFeature(centre=(50.0, 50.0), scale=30.0)
    assert Advection(true_model={"initial": feature}).truth().initial == feature


def test_the_model_that_is_fitted_knows_nothing_of_it():
    changed = replace(GYRE, true_model={"diffusivity": 2.0, "scheme": "semi_lagrangian"})
    np.testing.assert_array_equal(changed.predict(THETA, HERE, NOW), GYRE.predict(THETA, HERE, NOW))
    assert abs(changed.truth().predict(THETA, HERE, NOW) - GYRE.truth().predict(THETA, HERE, NOW)).max() > 0.1


def test_the_closed_form_s_truth_is_the_model_or_what_is_changed():
    assert Advection().truth() == Advection()
    louder = Advection(true_model={"initial": {"amplitude": 105.0}}).truth()
    theta = np.array([[5.0, 5.0]])
    ratio = louder.predict(theta, HERE, NOW) / Advection().predict(theta, HERE, NOW)
    np.testing.assert_allclose(ratio, 1.05)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cells": [20, 20]}, r"true_model\.cells=.*cannot differ.*may differ here: flow, initial"),
        ({"flow": {"amplitud": 0.1}}, r"true_model\.flow\.amplitud=0\.1.*may differ here: amplitude, length"),
        ({"flow": {"amplitude": -1.0}}, r"true_model\.flow\.amplitude=-1.*must be"),
        ({"flow": 3}, r"true_model\.flow=3.*must be a mapping"),
        ({"flow": UniformFlow()}, r"true_model\.flow=.*must have the model's parameters, mu, omega"),
        ({"order": 4}, r"true_model\.order=4.*3, 5, 7 or 9"),
        ({"order": {"a": 1}}, r"true_model\.order=.*has no component to change"),
        ({"diffusivity": -1.0}, r"true_model\.diffusivity=-1"),
        ([1], r"true_model=.*must be a mapping"),
    ],
)
def test_what_cannot_differ_is_refused_with_its_key(changes, message):
    with pytest.raises(InvalidValue, match=message):
        AdvectionDiffusion(cells=(64, 32), flow=DoubleGyre(), true_model=changes)


def test_positions_beyond_the_walls_are_kept_where_the_model_can_predict():
    beyond = np.array([[-3.0, 50.0], [90.0, 104.0], [60.0, 40.0]])
    np.testing.assert_array_equal(Advection().admissible(beyond), beyond)
    np.testing.assert_array_equal(GYRE.admissible(beyond), [[0.0, 50.0], [90.0, 100.0], [60.0, 40.0]])
