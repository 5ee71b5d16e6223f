"""Unknowns by name: the same fields as models configured so, in any combination."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from fieldrl.cli.compose import composed
from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.core.samples import Samples
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection import Advection
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.finite_volumes.resolution import CoarseGrid
from fieldrl.pde.flow import DoubleGyre
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.source import LocalisedSource
from fieldrl.runs.components import model
from fieldrl.runs.identity import identity

SMALL = partial(
    AdvectionDiffusion, cells=(48, 24), final_time=3.0, source=LocalisedSource(5.0, (120.0, 50.0), 25.0)
)
PLACES = np.random.default_rng(0).uniform((0, 0), (200, 100), (7, 2))
TIMES = np.linspace(0.2, 2.9, 7)


def bounds(lower, upper, **true):
    return {"lower": lower, "upper": upper, **true}


UNKNOWN = {
    "diffusivity": bounds(0.2, 3.0, true=1.0),
    "mu": bounds(0.0, 0.5, true=0.25),
    "source_x": bounds(60.0, 180.0),
    "amplitude": bounds(50.0, 150.0),
}


def test_unknowns_come_in_the_order_flow_model_source_feature_whatever_the_order_they_are_given_in():
    parameters = SMALL(unknown=UNKNOWN).parameters
    assert parameters.names == ("mu", "diffusivity", "source_x", "amplitude")
    assert parameters.units == ("1", "length^2/time", "length", "field unit")
    assert parameters.true[:2] == (0.25, 1.0)
    assert np.isnan(parameters.true[2:]).all()


def test_a_model_at_values_of_its_unknowns_is_the_model_that_is_configured_so():
    found = SMALL(unknown=UNKNOWN).predict(np.array([[0.4, 2.0, 90.0, 120.0]]), PLACES, TIMES)
    configured = SMALL(
        diffusivity=2.0,
        source=LocalisedSource(5.0, (90.0, 50.0), 25.0),
        initial=InitialFeature(120.0, (60.0, 40.0), 20.0),
    )
    expected = configured.predict(np.array([[0.4, np.pi / 5]]), PLACES, TIMES)
    np.testing.assert_array_equal(found, expected)


def test_a_solve_is_stored_under_what_it_depends_on():
    plain = SMALL()
    named = replace(plain, unknown=UNKNOWN)
    plain.solve(plain.parameters.true)
    named.solve([0.25, 1.0, 120.0, 100.0])
    assert plain.solutions.solves == 1
    named.solve([0.25, 1.5, 120.0, 100.0])
    assert plain.solutions.solves == 2


def test_the_vehicle_drifts_with_the_flow_s_own_parameters():
    named = SMALL(unknown={"diffusivity": UNKNOWN["diffusivity"]})
    np.testing.assert_array_equal(named.flow_parameters(np.array([2.0])), [0.25, np.pi / 5])


@pytest.mark.parametrize(
    ("unknown", "key"),
    [
        ({"depth": bounds(0, 1)}, "unknown.depth"),
        ({"mu": {"lower": 0.0}}, "unknown.mu"),
        ({"mu": bounds(0.5, 0.0)}, "unknown.mu.upper"),
        ({"mu": bounds(0.0, 0.5, true=0.6)}, "unknown.mu.true"),
        ({"scale": bounds(-1.0, 30.0)}, "unknown.scale.lower"),
        (
            {"source_opens": bounds(0.0, 2.0), "source_closes": bounds(1.5, 3.0)},
            "unknown.source_opens, source_closes",
        ),
    ],
)
def test_an_impossible_unknown_is_refused_by_its_name(unknown, key):
    with pytest.raises(InvalidValue) as error:
        SMALL(unknown=unknown)
    assert error.value.key == key


def test_a_flow_parameter_that_is_neither_unknown_nor_told_is_missed():
    with pytest.raises(InvalidValue, match="omega"):
        SMALL(unknown={"mu": UNKNOWN["mu"]}, true=[0.25, None])


def test_an_amplitude_may_be_sought_on_both_sides_of_0():
    model = SMALL(unknown={"amplitude": bounds(-50.0, 50.0)})
    found = model.predict(np.array([[-20.0], [20.0]]), PLACES, TIMES)
    alone = model.predict(np.array([[0.0]]), PLACES, TIMES)
    np.testing.assert_allclose(found.mean(axis=0), alone[0], atol=1e-9)


@pytest.mark.parametrize("kind", [Advection, AdvectionDiffusion])
def test_water_without_feature_and_source_is_refused(kind):
    with pytest.raises(InvalidValue, match=r"initial\.amplitude=0"):
        kind(initial=InitialFeature(amplitude=0.0))


def test_a_grid_too_coarse_for_the_narrowest_feature_is_told():
    with pytest.warns(CoarseGrid, match=r"at unknown\.scale\.lower"):
        SMALL(unknown={"scale": bounds(4.0, 30.0)})


@pytest.mark.parametrize(
    ("changes", "name", "key"),
    [
        ({"diffusivity": 1.2}, "diffusivity", "true_model.diffusivity"),
        ({"initial": {"amplitude": 110.0}}, "amplitude", "true_model.initial.amplitude"),
        ({"source": {"centre": [121.0, 50.0]}}, "source_x", "true_model.source.centre"),
    ],
)
def test_the_true_model_cannot_change_what_is_unknown(changes, name, key):
    with pytest.raises(InvalidValue) as error:
        SMALL(true_model=changes, unknown={name: bounds(1.0, 150.0)})
    assert error.value.key == key
    SMALL(true_model=changes, unknown={"mu": UNKNOWN["mu"]})


class Loud(DoubleGyre):
    names = ("amplitude", "omega")


def test_a_name_that_two_numbers_have_is_refused():
    with pytest.raises(InvalidValue, match="one of the flow's and one of the initial's"):
        SMALL(flow=Loud(), unknown={"amplitude": bounds(0.0, 0.5, true=0.25)})


def test_the_command_line_names_unknowns():
    config = composed(["unknown={mu: {true: .25, lower: 0, upper: .5}, diffusivity: {lower: .2, upper: 3}}"])
    assert model(config).parameters.names == ("mu", "diffusivity")


def test_a_run_without_named_unknowns_keeps_its_key():
    config = composed([])
    assert identity(config) == identity({name: value for name, value in config.items() if name != "unknown"})
    assert identity(config) != identity(config | {"unknown": {"mu": bounds(0.0, 0.5)}})


def test_an_error_from_the_configuration_has_the_key_that_was_written():
    with pytest.raises(FieldrlError, match=r"^unknown\.depth=.*what may be unknown here: mu, omega"):
        model(composed(["unknown={depth: {lower: 0, upper: 1}}"]))


EVERY = {
    "b_x": bounds(2.0, 8.0),
    "b_y": bounds(1.0, 9.0),
    "amplitude": bounds(50.0, 150.0),
    "centre_x": bounds(30.0, 70.0),
    "centre_y": bounds(30.0, 70.0),
    "scale": bounds(20.0, 60.0),
    "exponent": bounds(1.5, 3.0),
    "source_strength": bounds(1.0, 9.0),
    "source_x": bounds(70.0, 90.0),
    "source_y": bounds(70.0, 90.0),
    "source_width": bounds(5.0, 20.0),
    "source_opens": bounds(1.0, 3.0),
    "source_closes": bounds(5.0, 7.0),
}
PLUME = Advection(source=LocalisedSource(5.0, (80.0, 80.0), 12.0, 2.0, 6.0), unknown=EVERY)


def test_advection_knows_its_derivatives_by_every_number():
    theta, steps = PLUME.parameters.centre, 1e-5 * PLUME.parameters.half_width
    places, times = np.random.default_rng(1).uniform(20, 140, (40, 2)), np.linspace(0.5, 9.7, 40)
    found = PLUME.jacobian(theta[None], places, times)[0]
    for k, step in enumerate(steps):
        above, below = (theta + sign * step * np.eye(len(theta))[k] for sign in (1, -1))
        both = PLUME.predict(np.array([above, below]), places, times)
        np.testing.assert_allclose(found[:, k], (both[0] - both[1]) / (2 * step), rtol=1e-5, atol=1e-6)


def test_advection_at_values_of_its_unknowns_is_the_one_that_is_configured_so():
    theta = PLUME.parameters.centre
    parts = PLUME._unknowns.parts_at(theta)
    configured = Advection(initial=parts["initial"], source=parts["source"])
    places, times = np.random.default_rng(1).uniform(20, 140, (40, 2)), np.linspace(0.5, 9.7, 40)
    expected = configured.predict(theta[None, :2], places, times)
    np.testing.assert_allclose(PLUME.predict(theta[None], places, times), expected, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("p", [1, 3, 6])
def test_least_squares_finds_several_unknowns(p):
    chosen = {name: EVERY[name] for name in list(EVERY)[:p]}
    model = Advection(unknown=chosen)
    rng = np.random.default_rng(p)
    theta = model.parameters.centre + 0.6 * rng.uniform(-1, 1, p) * model.parameters.half_width
    times = np.tile(np.arange(1.0, 11.0), 3)
    places = 50.0 + times[:, None] * 5.0 + rng.uniform(-50, 50, (30, 2))
    samples = Samples.of(places, times, model.predict(theta[None], places, times)[0])
    found = LeastSquares(tikhonov=0.0).fit(FitProblem(model, samples, 0.0, leave_one_out=False))
    np.testing.assert_allclose(found.theta[0], theta, rtol=1e-5)
