"""Ordinary classes as flows: compiled or not, with or without streamfunction, alone and put together."""

from __future__ import annotations

import math
import pickle
from functools import partial

import numpy as np
import pytest
import xarray as xr
from numba import njit

from fieldrl.core.checks import InvalidValue
from fieldrl.core.compiled import call_flow
from fieldrl.core.domain import Circle, Domain
from fieldrl.core.flow_adapter import AdaptedFlow, UncompiledFlow, adapted
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.flow import (
    DoubleGyre,
    GriddedFlow,
    Rotated,
    Scaled,
    Shear,
    SolidRotation,
    Sum,
    TaylorGreen,
    UniformFlow,
    Vortices,
)
from fieldrl.pde.initial import InitialFeature
from fieldrl.vehicle.unicycle import Unicycle

SMALL = partial(AdvectionDiffusion, cells=(48, 24), final_time=2.0, truth_refinement=1)
POINTS = np.random.default_rng(1).uniform((0, 0), (200, 100), (40, 2))


class OwnGyre:
    """The double gyre as anybody would write it."""

    names, units = ("mu", "omega"), ("1", "rad/time")

    def __init__(self, amplitude=0.1, length=100.0):
        self.amplitude, self.length = amplitude, length

    def velocity(self, theta, x, y, t):
        s = theta[0] * np.sin(theta[1] * t)
        x, y = x / self.length, y / self.length
        phase, speed = np.pi * (s * x + 1 - 2 * s) * x, np.pi * self.amplitude * self.length
        u = -speed * np.sin(phase) * np.cos(np.pi * y)
        return u, speed * np.cos(phase) * np.sin(np.pi * y) * (2 * s * (x - 1) + 1)


class GyreInPython(OwnGyre):
    """The same, in a way that numba cannot compile."""

    def velocity(self, theta, x, y, t):
        return [*{"uv": OwnGyre.velocity(self, theta, x, y, t)}["uv"]] or sorted(locals())


class GyreInWords(OwnGyre):
    """The same for numbers only, neither for arrays nor for numba."""

    def velocity(self, theta, x, y, t):
        assert f"{float(x)}"
        s = theta[0] * math.sin(theta[1] * t)
        x, y = x / self.length, y / self.length
        phase, speed = math.pi * (s * x + 1 - 2 * s) * x, math.pi * self.amplitude * self.length
        u = -speed * math.sin(phase) * math.cos(math.pi * y)
        return {"u": u}["u"], sorted(
            [speed * math.cos(phase) * math.sin(math.pi * y) * (2 * s * (x - 1) + 1)]
        )[0]


class Stretching:
    """Water that runs apart in x: u = rate (x - 100)."""

    names, units = ("rate",), ("1/time",)

    def velocity(self, theta, x, y, t):
        return theta[0] * (x - 100.0), 0.0 * y


@njit
def _call(kernel, theta, constants, x, y, t, velocity):
    call_flow(kernel, theta.ctypes, constants.ctypes, x, y, t, velocity.ctypes)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Flows of every kind as the solver has them, and their parameters."""
    path = write_grid(tmp_path_factory.mktemp("flow") / "currents.npz")
    return [(adapted(flow), theta) for flow, theta in flows(path)]


@pytest.fixture
def grid_file(tmp_path):
    return write_grid(tmp_path / "currents.npz")


def write_grid(path):
    """v = (x y + t, x - t), which linear interpolation does not alter along each axis."""
    x, y, t = np.linspace(0, 200, 5), np.array([0.0, 30.0, 100.0]), np.array([0.0, 1.0, 3.0])
    at = np.meshgrid(t, x, y, indexing="ij")
    np.savez(path, x=x, y=y, t=t, u=1e-3 * at[1] * at[2] + at[0], v=1e-2 * at[1] - at[0])
    return path


def flows(path):
    return [
        (SolidRotation(), (0.1,)),
        (Shear(), (2.0, 0.05)),
        (TaylorGreen(), (5.0, 0.2)),
        (Vortices(), (200.0, -150.0)),
        (Sum([Vortices(), UniformFlow()]), (200.0, 100.0, 2.0, -1.0)),
        (Scaled(DoubleGyre()), (0.25, 0.6, 0.5)),
        (Rotated(TaylorGreen()), (5.0, 0.2, 0.4)),
        (Scaled(GriddedFlow(path), "twice"), (1.0, 2.0)),
        (GriddedFlow(path), (1.5,)),
    ]


def test_one_point_and_many_points_agree(found):
    velocity = np.empty(2)
    for flow, theta in found:
        for (x, y), expected in zip(POINTS, flow.velocity(theta, POINTS, 1.7), strict=True):
            _call(flow.kernel, np.array(theta), flow.constants, x, y, 1.7, velocity)
            np.testing.assert_allclose(velocity, expected, rtol=1e-12, atol=1e-12)


def test_velocity_is_the_rotated_gradient_of_the_streamfunction(found):
    dx, dy = np.array([1e-4, 0]), np.array([0, 1e-4])
    for flow, theta in found[:-2]:
        psi = partial(flow.streamfunction, theta, time=1.3)
        u = -(psi(POINTS + dy) - psi(POINTS - dy)) / 2e-4
        v = (psi(POINTS + dx) - psi(POINTS - dx)) / 2e-4
        np.testing.assert_allclose(flow.velocity(theta, POINTS, 1.3), np.stack([u, v], axis=-1), atol=1e-6)


def test_a_flow_of_one_s_own_is_compiled_and_gives_the_built_in_s_field():
    own, built_in = SMALL(flow=OwnGyre()), SMALL()
    assert own.flow.reason == ""
    theta = np.array([0.25, 0.6])
    difference = own.solve(theta) - built_in.solve(theta)
    assert np.abs(difference).max() < 1e-10


@pytest.mark.parametrize("kind", [GyreInPython, GyreInWords])
def test_a_flow_that_does_not_compile_runs_as_python_and_says_so_once(kind):
    wide = InitialFeature(centre=(100.0, 50.0), scale=120.0)
    coarse = partial(SMALL, cells=(10, 9), order=3, final_time=0.05, initial=wide)
    with pytest.warns(UncompiledFlow, match=kind.__name__):
        own = coarse(flow=kind())
    again = coarse(flow=kind())  # a warning would be an error
    theta = np.array([0.25, 0.6])
    difference = again.solve(theta) - coarse(flow=OwnGyre()).solve(theta)
    assert np.abs(difference).max() < 1e-10
    start, vehicle = np.array([60.0, 40.0, 0.2]), Unicycle()
    moved = [vehicle.step(start, 2, 1.0, flow, theta, own.domain) for flow in (own.flow, DoubleGyre())]
    np.testing.assert_allclose(*moved, rtol=1e-12)


@pytest.mark.parametrize("positive", [False, True])
def test_a_divergent_flow_solves_the_conservative_equation(positive):
    """dc/dt + d(u c)/dx = 0 with u = a (x - 100): c = exp(-a t) h(100 + (x - 100) exp(-a t), y)."""
    water, rate = {"final_time": 2.0, "lower": [0.1], "upper": [0.3], "true": [0.2]}, 0.2
    errors = []
    for n in (1, 2):
        model = AdvectionDiffusion(
            flow=Stretching(), diffusivity=0.0, cells=(60 * n, 30 * n), positive=positive, **water
        )
        inwards = POINTS * (0.6, 0.6) + (40, 20)
        found = model.predict(np.array([[rate]]), inwards, np.full(len(inwards), 2.0))[0]
        shrink = math.exp(-rate * 2.0)
        before = np.stack([100 + (inwards[:, 0] - 100) * shrink, inwards[:, 1]], axis=-1)
        errors.append(np.abs(found - shrink * model.initial.value(before)).max())
    assert errors[1] < 0.2
    assert errors[1] < errors[0] / 4


def test_water_that_runs_together_may_hold_more_than_at_the_start():
    model = SMALL(
        flow=Stretching(), diffusivity=0.0, cells=(200, 24), lower=[-1.5], upper=[-1.0], true=[-1.2],
        initial=InitialFeature(100.0, (100.0, 50.0), 60.0),
    )  # fmt: skip
    found = model.solve([-1.4])[-1]
    assert found.max() > 1000.0  # more than ten times what there was


def test_mass_is_kept_by_a_flow_without_streamfunction():
    model = SMALL(flow=OwnGyre())
    field = model.solve([0.25, 0.6])
    np.testing.assert_allclose(field.sum(axis=(1, 2)), field[0].sum(), rtol=1e-12)


def test_obstacles_and_the_other_scheme_need_a_streamfunction():
    with pytest.raises(InvalidValue, match=r"domain\.obstacles.*streamfunction"):
        SMALL(flow=OwnGyre(), domain=Domain(upper=(200.0, 100.0), obstacles=[Circle((90.0, 60.0), 10.0)]))
    with pytest.raises(InvalidValue, match=r"scheme.*streamfunction"):
        SMALL(flow=OwnGyre(), scheme="semi_lagrangian")


def test_a_flow_is_led_round_obstacles_by_its_streamfunction():
    domain = Domain(upper=(200.0, 100.0), obstacles=[Circle((90.0, 60.0), 10.0)])
    bounds = {"true": [4.0, 0.1], "lower": [1.0, 0.0], "upper": [8.0, 0.5]}
    assert np.isfinite(SMALL(flow=TaylorGreen(), domain=domain, **bounds).solve([4.0, 0.1])).all()


def test_the_true_model_may_change_an_own_flow_s_numbers():
    model = SMALL(flow=TaylorGreen(), true=[4, 0.1], lower=[1, 0], upper=[8, 0.5],
                  true_model={"flow": {"length": 100.0}})  # fmt: skip
    assert model.truth().flow.wrapped.length == 100.0


def test_a_gridded_flow_interpolates_in_space_and_time_and_holds_its_edge(grid_file):
    flow = GriddedFlow(grid_file)
    expected = [[1e-3 * 70 * 50 + 2.0, 0.7 - 2.0]]
    np.testing.assert_allclose(flow.velocity([1.0], [[70.0, 50.0]], 2.0), expected)
    later = flow.velocity([2.0], [[999.0, -5.0]], 50.0)
    np.testing.assert_allclose(later, [[2 * 3.0, 2 * (2.0 - 3.0)]])


def test_netcdf_and_npz_files_are_the_same_flow(grid_file, tmp_path):
    with np.load(grid_file) as file:
        dims = {"x": "x", "y": "y", "t": "t", "u": ("t", "x", "y"), "v": ("t", "x", "y")}
        data = xr.Dataset({name: (dims[name], file[name]) for name in ("u", "v")},
                          {name: file[name] for name in "xyt"})  # fmt: skip
    data.transpose("y", "t", "x").to_netcdf(tmp_path / "currents.nc", engine="netcdf4")
    flows = GriddedFlow(grid_file), GriddedFlow(tmp_path / "currents.nc")
    assert flows[0].contents == flows[1].contents


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"u": np.zeros((3, 3, 5))}, "of shape"),
        ({"x": np.zeros(5)}, "increasing"),
        ({"v": np.full((3, 5, 3), np.nan)}, "finite"),
        ({"v": None}, "must have v"),
    ],
)
def test_a_file_that_is_no_flow_is_refused(grid_file, change, rule):
    with np.load(grid_file) as file:
        arrays = {name: file[name] for name in file} | change
    np.savez(grid_file, **{name: array for name, array in arrays.items() if array is not None})
    with pytest.raises(InvalidValue, match=rule):
        GriddedFlow(grid_file)


def test_parts_of_a_sum_need_different_names():
    with pytest.raises(InvalidValue, match="twice: b_x, b_y"):
        Sum([UniformFlow(), UniformFlow()])


def test_an_adapted_flow_survives_pickling():
    flow = adapted(Sum([OwnGyre(), UniformFlow()]))
    copy = pickle.loads(pickle.dumps(flow))
    assert isinstance(copy, AdaptedFlow)
    theta = (0.25, 0.6, 1.0, 2.0)
    np.testing.assert_array_equal(copy.velocity(theta, POINTS, 1.0), flow.velocity(theta, POINTS, 1.0))
    assert copy.kernel != 0


def test_a_velocity_that_is_no_pair_is_refused():
    class Wrong:
        names, units = ("a",), ("1",)
        in_python = True

        def velocity(self, theta, x, y, t):
            return x

    with pytest.raises(InvalidValue, match=r"must return \(u, v\)"):
        adapted(Wrong()).velocity([1.0], POINTS, 0.0)
