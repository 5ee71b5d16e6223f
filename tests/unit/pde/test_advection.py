"""The closed-form model as a forward model: shapes, fields, bounds."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.core.domain import Domain
from fieldrl.estimator.problem import Compiled, Differentiable
from fieldrl.pde.advection import Advection
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.source import LocalisedSource

SOURCE = LocalisedSource(5.0, (80.0, 80.0), 10.0, opens=1.0, closes=6.0)
models = pytest.mark.parametrize(
    "model",
    [Advection(), Advection(source=SOURCE), Advection(InitialFeature(exponent=1.5))],
    ids=["q=2", "source", "q=1.5"],
)


def batch(m: int, n: int):
    rng = np.random.default_rng(m * 100 + n)
    return rng.uniform(-15, 15, (m, 2)), rng.uniform(0, 200, (n, 2)), rng.uniform(0, 20, n)


@models
@pytest.mark.parametrize(("m", "n"), [(1, 1), (3, 5), (7, 1), (1, 6), (0, 4), (4, 0)])
def test_a_batch_has_one_row_for_each_candidate_and_one_column_for_each_sample(model, m, n):
    theta, positions, times = batch(m, n)
    assert model.predict(theta, positions, times).shape == (m, n)
    assert model.jacobian(theta, positions, times).shape == (m, n, 2)


@models
def test_a_batch_is_what_loops_over_candidates_and_samples_give(model):
    theta, positions, times = batch(4, 5)
    prediction, slopes = model.predict(theta, positions, times), model.jacobian(theta, positions, times)
    for i in range(4):
        for j in range(5):
            one = theta[i : i + 1], positions[j : j + 1], times[j : j + 1]
            assert model.predict(*one)[0, 0] == prediction[i, j]
            np.testing.assert_array_equal(model.jacobian(*one)[0, 0], slopes[i, j])


@models
def test_arrays_of_any_layout_and_type_give_the_same(model):
    theta, positions, times = (np.round(array) for array in batch(4, 5))
    expected = model.predict(theta, positions, times)
    np.testing.assert_array_equal(
        model.predict(np.asfortranarray(theta), positions[::-1][::-1], times.astype(int)), expected
    )


@models
def test_the_field_is_the_prediction_at_the_grid_points(model):
    grid, b = model.domain.grid(7, 4), np.array([4.0, -3.0])
    field = model.field(b, 5.0, grid)
    assert field.shape == (7, 4)
    for i, x in enumerate(grid.x):
        for j, y in enumerate(grid.y):
            assert field[i, j] == model.predict(b[None], np.array([[x, y]]), np.array([5.0]))[0, 0]


def test_at_time_zero_the_field_is_the_initial_feature_whatever_the_flow():
    model = Advection(InitialFeature(exponent=3.0), source=SOURCE)
    theta, positions, _ = batch(5, 8)
    prediction = model.predict(theta, positions, np.zeros(8))
    np.testing.assert_allclose(prediction, np.tile(model.initial.value(positions), (5, 1)), rtol=1e-12)


def test_the_feature_travels_with_the_flow():
    model, b, positions = Advection(InitialFeature(exponent=1.0)), np.array([3.0, -2.0]), batch(1, 6)[1]
    moved = model.predict(b[None], positions + 4.0 * b, np.full(6, 4.0))[0]
    np.testing.assert_allclose(moved, model.initial.value(positions), rtol=1e-12)


def test_the_derivative_at_the_crease_of_exponent_one_is_zero():
    model = Advection(InitialFeature(centre=(50.0, 50.0), exponent=1.0))
    slopes = model.jacobian(np.array([[2.0, 2.0]]), np.array([[60.0, 60.0]]), np.array([5.0]))
    assert slopes[0, 0].tolist() == [0.0, 0.0]


def test_the_truth_is_the_model_itself_for_it_is_exact():
    model = Advection()
    assert model.truth() is model
    assert model.horizon == math.inf


def test_the_recorded_grid_has_square_cells_inside_the_domain():
    grid = Advection(domain=Domain((0.0, -50.0), (200.0, 50.0))).grid
    assert (grid.x.size, grid.y.size) == (100, 50)
    assert np.ptp(np.diff(grid.x)) < 1e-12
    assert grid.x[1] - grid.x[0] == pytest.approx(grid.y[1] - grid.y[0])


def test_the_grid_of_a_sliver_has_at_least_one_row():
    assert Advection(domain=Domain((0.0, 0.0), (1000.0, 1.0))).grid.y.size == 1


def test_the_model_is_compiled_and_differentiable():
    model = Advection()
    assert isinstance(model, Compiled)
    assert isinstance(model, Differentiable)
    assert model.parameters.names == ("b_x", "b_y")
    assert model.parameters.true == (5.0, 5.0)


def test_a_pickled_model_predicts_the_same():
    model, what = Advection(source=SOURCE), batch(2, 3)
    model.predict(*what)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(model)).predict(*what), model.predict(*what))


@pytest.mark.parametrize(
    ("key", "changed"),
    [
        ("true", {"true": (5.0,)}),
        ("true", {"true": (15.0, 0.0)}),
        ("upper", {"upper": (15.0, -15.0)}),
        ("lower", {"lower": (math.nan, 0.0)}),
        ("quadrature", {"quadrature": 1}),
        ("quadrature", {"quadrature": 4.5}),
    ],
)
def test_a_bad_value_is_refused_by_its_name(key, changed):
    with pytest.raises(InvalidValue) as error:
        Advection(**changed)
    assert error.value.key == key
