"""The reduced-order model: exact at its nodes, differentiable, certified, kept, refused."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.core.samples import Samples
from fieldrl.estimator.descent.coarse_search import box_grid
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.estimator.problem import Compiled, Differentiable, FitProblem
from fieldrl.pde import reduced
from fieldrl.pde.finite_volumes.inside import OutsideDomain
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.reduced import Building, ReducedAdvectionDiffusion
from fieldrl.pde.reduced_order import build, packing, splines
from fieldrl.pde.reduced_order.modes import modes
from fieldrl.pde.reduced_order.nodes import graded, nodes, pilot_axes
from fieldrl.pde.solutions import Solutions
from fieldrl.scenario.drawn import Drawn

pytestmark = pytest.mark.filterwarnings("ignore::fieldrl.pde.reduced.Building")
RNG = np.random.default_rng(4)
POSITIONS, TIMES = RNG.uniform((0, 0), (200, 100), (12, 2)), RNG.integers(0, 4, 12).astype(float)
FEATURE = InitialFeature(centre=(60.0, 40.0), scale=40.0)
SIZE = {"cells": (24, 12), "final_time": 3.0, "initial": FEATURE, "lower": (0.1, 0.3), "upper": (0.4, 0.9)}
SMALL = {**SIZE, "nodes": (7, 9), "left_out": 1e-3, "held_out": 4, "share": 0.5}


@pytest.fixture(scope="module")
def model():
    found = ReducedAdvectionDiffusion(**SMALL)
    found.prepare()
    return found


def inside(model, count):
    return model.parameters.centre + model.parameters.half_width * RNG.uniform(-1, 1, (count, 2))


def test_it_predicts_what_full_solves_predict(model):
    theta = inside(model, 20)
    off = model.predict(theta, POSITIONS, TIMES) - model.full().predict(theta, POSITIONS, TIMES)
    assert np.sqrt(np.mean(off**2)) < 2 * model.errors.max()
    assert np.abs(off).max() < 0.5


def test_splines_are_exact_at_their_nodes():
    axes = [splines.axis(graded(count, RNG.uniform(0.2, 1.0, 8))) for count in (7, 9)]
    values = RNG.normal(size=(7, 9, 1))
    one = packing.Decomposed(0.0, np.ones((1, 9)), splines.coefficients(axes, values))
    kept = packing.packed(axes, [(0.0, 1.0)] * 2, ((0, 0), (3, 3)), (3, 3), [one])
    grid = np.stack(np.meshgrid(*(axis.nodes for axis in axes), indexing="ij"), axis=-1).reshape(-1, 2)
    constants = packing.with_memo(kept)
    found = [reduced.kernel.state(theta, 0, constants)[0] for theta in grid]
    np.testing.assert_allclose(found, values.ravel(), atol=2e-6)


def polynomial(powers):
    """A model whose field is the product of u_k ** powers[k] everywhere, at time 1."""
    p = len(powers)
    axes = [splines.axis(np.linspace(-1, 1, count)) for count in (6, 8, 7)[:p]]
    values = np.ones([len(axis.nodes) for axis in axes])
    for k, (axis, power) in enumerate(zip(axes, powers, strict=True)):
        values = values * np.moveaxis(np.atleast_1d(axis.nodes**power).reshape([-1] + [1] * (p - 1)), 0, k)
    one = packing.Decomposed(1.0, np.ones((1, 81)), splines.coefficients(axes, values[..., None]))
    return packing.with_memo(packing.packed(axes, [(2.0, 4.0)] * p, ((0, 0), (9, 9)), (9, 9), [one]))


@pytest.mark.parametrize("p", [1, 2, 3])
def test_polynomials_of_degree_five_are_reproduced_with_their_derivatives(p):
    powers = (5, 3, 2)[:p]
    u = RNG.uniform(-1, 1, (50, p))
    predicted, jacobian = reduced.kernel.evaluate(
        2.0 + 4.0 * u, np.full((1, 2), 4.5), np.ones(1), polynomial(powers)
    )
    expected = np.prod(u**powers, axis=1)
    np.testing.assert_allclose(predicted[:, 0], expected, atol=1e-5)
    for k in range(p):
        slope = expected / u[:, k] * powers[k] / 4.0
        np.testing.assert_allclose(jacobian[:, 0, k], slope, atol=2e-5)


@pytest.mark.parametrize("p", [1, 2, 3])
def test_candidates_on_a_grid_are_what_they_are_alone_bit_for_bit(p):
    constants, grid = polynomial((5, 3, 2)[:p]), 2.0 + 4.0 * box_grid(9, p)
    elsewhere = 2.0 + 4.0 * RNG.uniform(-1, 1, (5, p))
    theta = np.concatenate([grid, grid[::-1][:20], grid[:4], elsewhere, grid[5:30]])
    samples = RNG.uniform(1, 8, (3, 2)), np.ones(3)
    together = reduced.kernel.evaluate(theta, *samples, constants)
    for i, one in enumerate(theta):
        alone = reduced.kernel.evaluate(one[None], *samples, constants)
        np.testing.assert_array_equal(together[0][i], alone[0][0])
        np.testing.assert_array_equal(together[1][i], alone[1][0])


def test_the_jacobian_is_that_of_the_predictions(model):
    theta, step = inside(model, 10) * 0.98 + 0.02 * model.parameters.centre, 1e-6
    found = model.jacobian(theta, POSITIONS, TIMES)
    for k in range(2):
        there, back = theta.copy(), theta.copy()
        there[:, k] += step
        back[:, k] -= step
        slope = (model.predict(there, POSITIONS, TIMES) - model.predict(back, POSITIONS, TIMES)) / (2 * step)
        np.testing.assert_allclose(found[..., k], slope, atol=1e-4 * np.abs(slope).max())


def test_the_memo_changes_no_bit(model):
    theta = inside(model, 3)
    many = RNG.uniform((0, 0), (200, 100), (packing.SLOTS + 50, 2))
    whole = model.predict(theta, many, np.full(len(many), 2.0))
    for i in (0, 1, packing.SLOTS // 2, len(many) - 1):
        alone = model.predict(theta, many[i : i + 1], np.array([2.0]))
        np.testing.assert_array_equal(whole[:, i], alone[:, 0])
    np.testing.assert_array_equal(whole, model.predict(theta, many, np.full(len(many), 2.0)))


def test_a_field_is_that_of_its_predictions(model):
    theta = inside(model, 1)[0]
    field = model.field(theta, 2.0, model.grid)
    points = model.grid.points
    values = model.predict(theta[None], points, np.full(len(points), 2.0))[0]
    np.testing.assert_allclose(field.ravel(), values, atol=1e-4)


def test_it_is_compiled_and_differentiable_and_least_squares_finds_the_truth(model):
    assert isinstance(model, Differentiable)
    assert isinstance(model, Compiled)
    theta = np.array([0.22, 0.71])
    samples = Samples.of(POSITIONS, TIMES, model.predict(theta[None], POSITIONS, TIMES)[0])
    fit = LeastSquares(tikhonov=0.0).fit(FitProblem(model, samples, 0.0))
    np.testing.assert_allclose(fit.theta[0], theta, atol=1e-5)


def test_an_error_above_the_share_of_the_noise_is_refused(model):
    worst = model.errors.max()
    replace(model, share=1.01 * worst).prepare()
    replace(model, noise=10.0, share=0.11 * worst).prepare()
    with pytest.raises(InvalidValue, match="more nodes") as error:
        replace(model, share=0.99 * worst).prepare()
    assert error.value.key == "nodes"


def test_its_errors_are_those_of_fresh_solves(model):
    parameters, full = model.parameters, model.full()
    for at, found in zip(build.fresh(4, 2, 0), model.errors, strict=True):
        theta = parameters.centre + parameters.half_width * at
        states = [reduced.kernel.state(theta, which, model.constants).reshape(24, 12) for which in range(4)]
        off = np.array(states) - full.solve(theta)
        np.testing.assert_allclose(np.sqrt(np.mean(off**2, axis=(1, 2))), found, rtol=1e-3, atol=1e-5)


def test_it_is_kept_on_disk_and_read_by_what_it_depends_on(tmp_path, monkeypatch):
    monkeypatch.setattr(reduced, "_READY", {})
    store = Solutions(0.0, tmp_path)
    model = ReducedAdvectionDiffusion(**SMALL, reduced_models=store)
    constants = model.constants.copy()
    assert not list(tmp_path.glob("*.solves"))
    monkeypatch.setattr(reduced, "_READY", {})
    again = pickle.loads(pickle.dumps(model))
    monkeypatch.setattr(build, "solved", None)  # no solve is needed
    np.testing.assert_array_equal(again.constants[: int(constants[packing.LABELS_AT])], constants[: int(constants[packing.LABELS_AT])])  # fmt: skip  # noqa: E501
    monkeypatch.setattr(reduced, "_READY", {})
    for change in ({"diffusivity": 2.0}, {"nodes": (7, 10)}, {"upper": (0.4, 0.8)}, {"left_out": 2e-3}):
        with pytest.raises(TypeError):  # it would be built
            replace(model, **change).prepare()


def test_a_build_that_was_killed_loses_no_finished_solve(tmp_path, monkeypatch):
    monkeypatch.setattr(reduced, "_READY", {})
    model = ReducedAdvectionDiffusion(**SMALL, reduced_models=Solutions(0.0, tmp_path))

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(build, "decomposed", killed)
        with pytest.raises(KeyboardInterrupt):
            model.prepare()
    (folder,) = tmp_path.glob("*.solves")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    keeping = model._keeping()
    monkeypatch.setattr(ReducedAdvectionDiffusion, "_keeping", lambda self: keeping)
    model.prepare()
    assert len(before) > 30
    assert keeping.solutions.solves == model.held_out


def test_the_user_is_told_once_before_and_once_after_a_build(tmp_path, monkeypatch):
    monkeypatch.setattr(reduced, "_READY", {})
    model = ReducedAdvectionDiffusion(**SMALL, reduced_models=Solutions(0.0, tmp_path))
    with pytest.warns(Building) as told:
        model.prepare()
    before, after = [str(one.message) for one in told if one.category is Building]
    assert "solves, about" in before
    assert str(tmp_path) in before
    assert "4 fresh solves" in after


def test_other_unknowns_are_reduced_too():
    unknown = {
        "mu": {"true": 0.25, "lower": 0.2, "upper": 0.3},
        "diffusivity": {"true": 2.0, "lower": 1.0, "upper": 3.0},
    }
    model = ReducedAdvectionDiffusion(**SMALL | {"nodes": (6, 6), "true": (0.25, 0.6)}, unknown=unknown)
    theta = np.array([[0.23, 1.5]])
    off = model.predict(theta, POSITIONS, TIMES) - model.full().predict(theta, POSITIONS, TIMES)
    assert np.abs(off).max() < 0.2


def test_a_drawn_truth_costs_no_check_and_no_model(model):
    own = replace(model, reduced_truth=True, truth_refinement=1)
    drawn = Drawn().draw(own, np.random.default_rng(0))
    assert drawn.parameters.true != own.parameters.true
    assert drawn.truth().constants is own.constants
    assert drawn.truth().parameters.true == drawn.parameters.true
    with pytest.raises(InvalidValue, match="another model"):
        Drawn(place=((50.0, 40.0), (60.0, 40.0))).draw(own, np.random.default_rng(0))


def test_the_truth_is_a_full_solve_on_the_finer_grid_unless_it_shall_be_reduced(model):
    assert type(model.truth()) is reduced.AdvectionDiffusion
    assert model.truth().cells == (48, 24)
    assert type(replace(model, reduced_truth=True).truth()) is ReducedAdvectionDiffusion


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("nodes", (7,)),
        ("nodes", (5, 9)),
        ("left_out", 0.0),
        ("held_out", 0),
        ("noise", 0.0),
        ("share", 0.0),
        ("positive", True),
    ],
)
def test_what_is_impossible_is_refused_by_its_name(key, value):
    with pytest.raises(InvalidValue) as error:
        ReducedAdvectionDiffusion(**SMALL | {key: value})
    assert error.value.key == key


def test_times_between_snapshots_and_places_outside_are_refused(model):
    with pytest.raises(InvalidValue, match=r"not at 1\.5") as error:
        model.predict(inside(model, 1), POSITIONS[:1], np.array([1.5]))
    assert error.value.key == "interval"
    with pytest.raises(OutsideDomain):
        model.predict(inside(model, 1), np.array([[-1.0, 2.0]]), np.ones(1))
    with pytest.raises(InvalidValue, match="within the bounds"):
        model.predict([[0.6, 0.6]], POSITIONS[:1], np.ones(1))


def test_modes_leave_out_as_little_as_they_were_told():
    snapshots = (RNG.normal(size=(20, 6)) @ RNG.normal(size=(6, 500)) * 10).astype(np.float32)
    amplitudes, fields = modes(snapshots, 1e-2)
    assert amplitudes.shape == (20, 6)
    np.testing.assert_allclose(amplitudes @ fields, snapshots, atol=1e-3)
    coarse = modes(snapshots, 10.0)
    left = np.sqrt(np.mean((coarse[0] @ coarse[1] - snapshots) ** 2))
    assert coarse[0].shape[1] < 6
    assert left <= 10.0


def test_nodes_are_close_together_where_the_field_moves_fast_and_lines_short_where_it_does_not_move():
    pilot = pilot_axes((6, 40))
    x, y = np.meshgrid(*pilot, indexing="ij")
    found = nodes((6, 40), pilot, np.sin(6 * (x + 1.1) * (y + 1) ** 2)[..., None])
    assert found.along == 1
    gaps = np.diff(found.axes[1])
    assert gaps[-5:].max() < gaps[:5].min()
    counts = [len(line.nodes) for line in found.lines]
    assert counts[0] < counts[-1] == 40
    assert found.points.shape == (sum(counts), 2)


def test_the_number_of_threads_changes_no_bit(model, monkeypatch):
    monkeypatch.setattr(reduced, "_READY", {})
    monkeypatch.setattr(build, "threads", lambda: 1)
    alone = ReducedAdvectionDiffusion(**SMALL).constants
    end = int(alone[packing.LABELS_AT])
    head = np.r_[: packing.CALLS, packing.CALLS + 1 : end]
    assert alone[head].tobytes() == model.constants[head].tobytes()
