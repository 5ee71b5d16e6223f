import pickle
import warnings
from dataclasses import dataclass, replace

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue, SolveFailed
from fieldrl.core.domain import Circle, Domain, Rectangle
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.finite_volumes import sampling
from fieldrl.pde.finite_volumes.inside import OutsideDomain
from fieldrl.pde.finite_volumes.resolution import CoarseGrid
from fieldrl.pde.flow import DoubleGyre
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.solutions import Solutions

MODEL = AdvectionDiffusion(cells=(64, 32), final_time=3.0)
THETA = (0.25, 0.6)
RNG = np.random.default_rng(2)
POSITIONS, TIMES = RNG.uniform((0, 0), (200, 100), (12, 2)), RNG.integers(0, 4, 12).astype(float)


@dataclass(frozen=True)
class Exploding:
    """A flow that is no longer finite after t = 1."""

    names = ("mu", "omega")
    units = ("1", "rad/time")
    value: float = np.nan
    after: float = 1.0

    def velocity(self, theta, positions, time):
        return DoubleGyre().velocity(theta, positions, time)

    def streamfunction(self, theta, positions, time):
        psi = DoubleGyre().streamfunction(theta, positions, time)
        return psi * self.value if time > self.after and theta[0] == 0.3 else psi


def test_prediction_has_a_row_for_each_candidate():
    rows = MODEL.predict([THETA, (0.1, 1.0)], POSITIONS, TIMES)
    assert rows.shape == (2, 12)
    np.testing.assert_array_equal(rows[1:], MODEL.predict([(0.1, 1.0)], POSITIONS, TIMES))


def test_no_samples_give_no_predictions():
    assert MODEL.predict([THETA], np.empty((0, 2)), np.empty(0)).shape == (1, 0)


def test_one_solve_serves_every_sample():
    model = replace(MODEL, solutions=Solutions())
    for _ in range(3):
        model.predict([THETA], POSITIONS, TIMES)
    model.field(THETA, 2.0, model.grid)
    assert model.solutions.solves == 1


def test_predictions_are_the_same_bits_with_or_without_a_store(tmp_path):
    kept = [
        replace(MODEL, solutions=store).predict([THETA], POSITIONS, TIMES + 0.0).tobytes()
        for store in (
            Solutions(),
            Solutions(0.0),
            Solutions(directory=str(tmp_path)),
            Solutions(directory=str(tmp_path)),
        )
    ]
    assert len(set(kept)) == 1


def test_prediction_agrees_with_the_field():
    grid = MODEL.domain.grid(11, 7)
    values = MODEL.predict([THETA], grid.points, np.full(77, 2.0))[0].reshape(11, 7)
    np.testing.assert_allclose(MODEL.field(THETA, 2.0, grid), values, rtol=1e-12, atol=1e-12)


def test_field_at_time_zero_is_the_initial_feature():
    values = AdvectionDiffusion().predict([THETA], POSITIONS, np.zeros(12))[0]
    np.testing.assert_allclose(values, AdvectionDiffusion().initial.value(POSITIONS), atol=1e-3)


def test_a_time_between_snapshots_is_solved_for():
    fine = replace(MODEL, interval=0.25)
    between = np.full(12, 1.75)
    np.testing.assert_allclose(
        MODEL.predict([THETA], POSITIONS, between), fine.predict([THETA], POSITIONS, between), atol=1e-3
    )


def test_final_time_need_not_be_a_multiple_of_the_interval():
    model = replace(MODEL, final_time=1.5)
    np.testing.assert_array_equal(model.snapshot_times, [0.0, 1.0, 1.5])
    assert model.solve(THETA).shape == (3, 64, 32)


def test_sampling_reproduces_polynomials_between_cells():
    edges = np.linspace(0.0, 3.0, 31)
    averages = np.diff(edges**9) / 9 / np.diff(edges)
    points = np.linspace(0.6, 2.4, 50)
    indices, weights = sampling.stencil(points, 0.0, 3.0, 30)
    np.testing.assert_allclose((averages[indices] * weights).sum(axis=1), points**8, rtol=1e-9)


def test_sampling_mirrors_at_the_walls():
    cells = np.cos(np.pi * (np.arange(40) + 0.5) / 40) * np.sinc(1 / 80)
    points = np.linspace(0.0, 1.0, 23)
    np.testing.assert_allclose(
        sampling.matrix(points, 0.0, 1.0, 40) @ cells, np.cos(np.pi * points), atol=1e-9
    )


def test_truth_has_the_same_physics_on_a_finer_grid():
    truth = MODEL.truth()
    assert truth.cells == (128, 64)
    assert truth.parameters == MODEL.parameters
    assert truth.flow == MODEL.flow
    assert replace(MODEL, truth_refinement=1).truth() == replace(MODEL, truth_refinement=1)


def test_parameters_are_those_of_the_flow():
    parameters = MODEL.parameters
    assert parameters.names == ("mu", "omega")
    assert parameters.true == (0.25, np.pi / 5)
    assert MODEL.horizon == 3.0


def test_model_survives_pickling():
    copy = pickle.loads(pickle.dumps(MODEL))
    assert copy == MODEL
    np.testing.assert_array_equal(
        copy.predict([THETA], POSITIONS, TIMES), MODEL.predict([THETA], POSITIONS, TIMES)
    )


def test_field_is_zero_inside_an_obstacle():
    model = replace(MODEL, domain=Domain(upper=(200.0, 100.0), obstacles=(Circle((60.0, 40.0), 15.0),)))
    assert model.field(THETA, 1.0, model.domain.grid(3, 3)).shape == (3, 3)
    assert (
        not model.predict([THETA], [(60.0, 40.0)], [0.0]).any()
        or model.field(THETA, 0.0, model.grid)[19, 12] == 0
    )


@pytest.mark.parametrize("position", [(-1e-6, 50), (200.1, 50), (100, 100.5), (np.nan, 3)])
def test_a_sample_outside_the_domain_is_refused(position):
    with pytest.raises(OutsideDomain, match=r"positions.*must lie in the domain"):
        MODEL.predict([THETA], [position], [1.0])


@pytest.mark.parametrize("time", [-0.1, 3.01, np.nan])
def test_a_sample_outside_the_solved_time_is_refused(time):
    with pytest.raises(OutsideDomain, match=r"times.*must lie in \[0, 3\]"):
        MODEL.predict([THETA], [(50.0, 50.0)], [time])


@pytest.mark.parametrize("theta", [(np.nan, 0.6), (np.inf, 0.6), (0.1,), (0.1, 0.2, 0.3)])
def test_impossible_theta_is_refused(theta):
    with pytest.raises(InvalidValue, match="theta"):
        MODEL.predict([theta], POSITIONS, TIMES)


def test_a_failed_solve_carries_theta_and_time():
    model = replace(MODEL, flow=Exploding())
    with pytest.raises(SolveFailed) as failure:
        model.predict([(0.3, 0.6)], POSITIONS, TIMES)
    assert failure.value.theta == (0.3, 0.6)
    assert 1.0 <= failure.value.time <= 2.0


def test_a_flow_too_fast_to_solve_fails_with_theta():
    with pytest.raises(SolveFailed, match="substeps"):
        replace(MODEL, flow=Exploding(1e9)).solve((0.3, 0.6))


def test_other_candidates_are_solved_after_a_failure():
    model = replace(MODEL, flow=Exploding())
    with pytest.raises(SolveFailed):
        model.solve((0.3, 0.6))
    assert np.isfinite(model.solve(THETA)).all()


def test_bounds_that_hold_unstable_flows_are_refused():
    with pytest.raises(InvalidValue, match=r"upper.*cannot follow stably.*narrow the bounds"):
        AdvectionDiffusion(upper=(1e7, 1.3))
    with pytest.raises(InvalidValue, match="cannot follow stably"):
        AdvectionDiffusion(flow=Exploding(after=-1.0), lower=(0.0, 0.1), upper=(0.3, 1.3))


def test_a_flow_that_takes_too_many_steps_is_refused():
    with pytest.raises(InvalidValue, match=r"upper.*more than 200000 steps in the fastest flow"):
        AdvectionDiffusion(flow=DoubleGyre(amplitude=1e6))


def test_a_grid_too_coarse_for_the_feature_warns_with_the_number():
    with pytest.warns(CoarseGrid, match=r"cells=\[20, 10\].*rises over 2\.\d cells.*at least 5"):
        AdvectionDiffusion(cells=(20, 10))


def test_obstacles_in_the_feature_raise_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        replace(MODEL, domain=Domain(upper=(200.0, 100.0), obstacles=(Circle((60.0, 40.0), 15.0),)))


@pytest.mark.parametrize(
    "bad",
    [
        {"diffusivity": -1.0},
        {"diffusivity": float("nan")},
        {"cells": (64, 4)},
        {"cells": (64,)},
        {"cells": (64.5, 32)},
        {"cells": "64x32"},
        {"final_time": 0.0},
        {"interval": -1.0},
        {"order": 4},
        {"courant": 0.0},
        {"courant": 1.5},
        {"courant": 1e-6},
        {"diffusivity": 1e6},
        {"positive": 1},
        {"truth_refinement": 0},
        {"true": (0.25,)},
        {"true": (0.6, 0.6)},
        {"upper": (0.0, 1.3)},
    ],
)
def test_impossible_settings_are_refused(bad):
    with pytest.raises(InvalidValue, match=next(iter(bad))):
        AdvectionDiffusion(**bad)


def test_positivity_needs_a_feature_without_negative_values():
    with pytest.raises(InvalidValue, match="positive"):
        AdvectionDiffusion(positive=True, initial=InitialFeature(-100.0, (60.0, 40.0), 20.0))


def test_obstacles_that_leave_no_water_are_refused():
    with pytest.raises(InvalidValue, match="obstacles"):
        replace(MODEL, domain=Domain(upper=(200.0, 100.0), obstacles=(Rectangle((-1, -1), (201, 101)),)))
