"""Is Eq. (29) solved? Orders of convergence, conservation, exact limits, symmetry, positivity."""

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import pytest

from fieldrl.core.domain import Circle, Domain, Rectangle
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.finite_volumes import stencils, stepping
from fieldrl.pde.flow import DoubleGyre, UniformFlow
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.source import LocalisedSource

BASIN = Domain(upper=(200.0, 100.0))
GYRE = AdvectionDiffusion(cells=(64, 32), final_time=5.0)


@dataclass(frozen=True)
class SolidBody:
    """Water that turns as a whole round a centre; theta = (angular velocity, unused)."""

    centre: tuple[float, float] = (100.0, 100.0)
    names = ("rate", "unused")
    units = ("rad/time", "1")

    def velocity(self, theta, positions, time):
        x, y = np.asarray(positions).T
        return theta[0] * np.stack([-(y - self.centre[1]), x - self.centre[0]], axis=-1)

    def streamfunction(self, theta, positions, time):
        x, y = np.asarray(positions).T
        return 0.5 * theta[0] * ((x - self.centre[0]) ** 2 + (y - self.centre[1]) ** 2)


@dataclass(frozen=True)
class Custom:
    """Any function as initial feature."""

    function: object

    def value(self, positions):
        return self.function(*np.asarray(positions).T)


def still(**changes):
    """Water at rest."""
    return AdvectionDiffusion(
        flow=UniformFlow(),
        true=(0.0, 0.0),
        lower=(-9.0, -9.0),
        upper=(9.0, 9.0),
        **{"domain": BASIN, **changes},
    )


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def slope(sizes, errors):
    """Fitted order of convergence of errors against cell or step sizes."""
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]


def gaussian(points, time, start, scale, rho, velocity=(0.0, 0.0)):
    """The free-space solution that starts as exp(-r^2 / scale^2)."""
    spread = scale**2 + 4 * rho * time
    offset = points - np.asarray(start) - time * np.asarray(velocity)
    return 100 * scale**2 / spread * np.exp(-np.sum(offset**2, axis=-1) / spread)


@cache
def smooth_solution(order, nx):
    """A smooth feature after three time units of the gyre, at fixed points."""
    model = AdvectionDiffusion(
        initial=InitialFeature(centre=(70.0, 45.0), scale=25.0),
        diffusivity=20.0,
        cells=(nx, nx // 2),
        final_time=2.0,
        order=order,
    )
    return model.field((0.25, 0.6), 2.0, BASIN.grid(40, 20))


@pytest.mark.parametrize(("order", "expected"), [(3, 2.7), (5, 3.7), (7, 3.8), (9, 3.8)])
def test_order_in_space_is_at_least_that_of_the_stencils_or_four(order, expected):
    reference = smooth_solution(9, 320)
    sizes = np.array([40, 56, 80, 112])
    errors = [rms(smooth_solution(order, n) - reference) for n in sizes]
    assert slope(1 / sizes, errors) > expected


@pytest.mark.parametrize(("order", "expected"), [(3, 2.8), (9, 7.5)])
def test_order_in_space_against_the_translated_gaussian(order, expected):
    start, velocity, domain = (80.0, 90.0), (8.0, 3.0), Domain(upper=(200.0, 200.0))
    sizes, grid = np.array([64, 76, 90, 104]), domain.grid(70, 70)
    exact = gaussian(grid.points, 3.0, start, 16.0, 1.0, velocity).reshape(70, 70)
    errors = []
    for n in sizes:
        initial = InitialFeature(centre=start, scale=16.0)
        model = still(initial=initial, domain=domain, cells=(n, n), final_time=3.0, order=order, courant=0.1)
        errors.append(rms(model.field(velocity, 3.0, grid) - exact))
    assert slope(1 / sizes, errors) > expected


def test_order_in_time_is_four():
    theta = np.array([0.4, 1.2])
    model = AdvectionDiffusion(
        cells=(64, 32), initial=InitialFeature(centre=(60, 40), scale=40.0), diffusivity=5.0
    )
    steps, results = [], []
    for courant in (1.0, 0.7, 0.5, 0.35, 0.06):
        scheme = replace(model, courant=courant)._scheme
        steps.append(scheme.substeps(scheme.streamfunction(theta, np.array([0.0, 0.5, 1.0])), 1.0))
        results.append(scheme.march(theta, model._start, [0.0, 1.0])[-1])
    errors = [rms(result - results[-1]) for result in results[:-1]]
    assert slope(1 / np.array(steps[:-1]), errors) > 3.7


def test_time_steps_contribute_less_than_a_tenth_of_the_error_in_space():
    full, small = (replace(GYRE, courant=c).solve((0.25, 0.6))[-1] for c in (1.0, 0.1))
    fine = replace(GYRE, cells=(256, 128)).solve((0.25, 0.6))[-1].reshape(64, 4, 32, 4).mean(axis=(1, 3))
    assert rms(full - small) < 0.1 * rms(small - fine)


@pytest.mark.parametrize("order", [3, 5, 7, 9])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.7, 1.0])
def test_any_mix_of_advection_and_diffusion_at_the_stated_limit_is_stable(order, share):
    phase = np.linspace(0, np.pi, 400)
    half = (np.arange((order + 1) // 2) + 0.5)[:, None] * phase
    even = 2 * np.array(stencils.EVEN[order]) @ np.cos(half)
    upwind = 2j * np.array(stencils.UPWIND[order]) @ np.sin(half)
    gradient = 2j * np.array(stencils.GRADIENT[order]) @ np.sin(half)
    difference = 2j * np.sin(phase / 2)
    advection = -share * stepping.ADVECTION_LIMIT[order] * (even - upwind) * difference
    diffusion = (1 - share) * stepping.DIFFUSION_LIMIT[order] * gradient * difference
    z, growth = advection[:, None] + diffusion[None, :], 1.0
    for fraction in stepping.CHAIN:
        growth = 1 + fraction * z * growth
    assert np.abs(growth).max() <= 1 + 1e-9


@pytest.mark.parametrize("positive", [False, True])
@pytest.mark.parametrize("theta", [(0.0, 0.5), (0.25, np.pi / 5), (0.5, 1.3)])
def test_mass_is_kept_to_rounding(theta, positive):
    solution = replace(GYRE, final_time=10.0, positive=positive).solve(theta)
    mass = solution.sum(axis=(1, 2))
    np.testing.assert_allclose(mass, mass[0], rtol=1e-12)


def test_mass_grows_by_what_the_source_adds():
    source = LocalisedSource(strength=3.0, centre=(80.0, 50.0), width=12.0, opens=0.7, closes=2.2)
    model = replace(GYRE, source=source, cells=(96, 48), final_time=4.0)
    mass = model.solve((0.25, 0.6)).sum(axis=(1, 2)) * np.prod(model._scheme.cell)
    added = 3.0 * np.pi * 12.0**2 * np.clip(model.snapshot_times - 0.7, 0, 1.5)
    np.testing.assert_allclose(mass - mass[0], added, rtol=1e-6, atol=1e-9 * mass[0])


def test_source_in_still_water_follows_its_integral():
    source = LocalisedSource(strength=3.0, centre=(80.0, 50.0), width=12.0, opens=0.7, closes=2.2)
    model = still(source=source, diffusivity=0.0, cells=(96, 48), final_time=4.0)
    points = np.array([[80.0, 50.0], [90.0, 45.0]])
    without = replace(model, source=None).predict([(0, 0)], points, [4.0, 4.0])
    expected = 1.5 * source.rate(points, 1.0)
    np.testing.assert_allclose(
        (model.predict([(0, 0)], points, [4.0, 4.0]) - without)[0], expected, rtol=1e-4
    )


@pytest.mark.parametrize("obstacles", [(), (Circle((120.0, 50.0), 15.0),)])
def test_a_constant_field_stays_constant(obstacles):
    model = replace(
        GYRE,
        domain=Domain(upper=(200.0, 100.0), obstacles=obstacles),
        initial=Custom(lambda x, y: np.full_like(x, 7.0)),
    )
    solution = model.solve((0.4, 1.0))
    np.testing.assert_allclose(solution[:, ~model._scheme.solid], 7.0, rtol=1e-12)


def test_undershoot_is_below_one_percent_on_the_default_grid():
    model = AdvectionDiffusion()
    solution = model.solve(model.parameters.true)
    assert solution.min() > -0.01 * 100
    assert solution.max() <= solution[0].max() * (1 + 1e-6)


def test_positivity_option_leaves_no_negative_value_anywhere():
    sharp = InitialFeature(centre=(60.0, 40.0), scale=20.0, exponent=6.0)
    model = replace(GYRE, initial=sharp, diffusivity=0.1, positive=True, cells=(128, 64))
    assert model.solve((0.25, 0.6)).min() >= 0.0
    assert model.field((0.25, 0.6), 5.0, BASIN.grid(90, 45)).min() >= 0.0
    assert replace(model, positive=False).solve((0.25, 0.6)).min() < -0.1


def test_positivity_option_keeps_the_order_where_the_field_is_smooth():
    plain, limited = (
        replace(
            GYRE, cells=(128, 64), initial=InitialFeature(centre=(60, 40), scale=30), positive=positive
        ).solve((0.25, 0.6))[-1]
        for positive in (False, True)
    )
    assert rms(plain - limited) < 0.02


def test_diffusing_gaussian_spreads_as_the_exact_solution():
    model = still(initial=InitialFeature(centre=(100, 50), scale=10.0), diffusivity=2.0, cells=(128, 64))
    grid = BASIN.grid(60, 30)
    exact = gaussian(grid.points, 10.0, (100, 50), 10.0, 2.0).reshape(60, 30)
    assert np.abs(model.field((0, 0), 10.0, grid) - exact).max() < 1e-3


def test_translated_gaussian_arrives_without_diffusion():
    model = still(initial=InitialFeature(centre=(60, 40), scale=12.0), diffusivity=0.0, cells=(160, 80))
    grid = BASIN.grid(100, 50)
    exact = gaussian(grid.points, 10.0, (60, 40), 12.0, 0.0, (7.0, 2.0)).reshape(100, 50)
    assert np.abs(model.field((7.0, 2.0), 10.0, grid) - exact).max() < 0.05


def test_water_that_leaves_takes_its_feature_with_it():
    model = still(initial=InitialFeature(centre=(150, 50), scale=12.0), cells=(160, 80), final_time=20.0)
    solution = model.solve((8.0, 0.0))
    assert solution[-1].sum() < 1e-4 * solution[0].sum()
    assert solution.min() > -0.1


def test_rotating_cone_comes_back_after_a_turn():
    domain = Domain(upper=(200.0, 200.0))

    def cone(x, y):
        return np.maximum(0.0, 100 * (1 - np.hypot(x - 100, y - 60) / 25))

    model = AdvectionDiffusion(
        flow=SolidBody(),
        initial=Custom(cone),
        diffusivity=0.0,
        domain=domain,
        cells=(100, 100),
        true=(0.6, 1.0),
        lower=(0.0, 0.0),
        upper=(1.0, 2.0),
        positive=True,
    )
    solution = model.solve((2 * np.pi / 10, 1.0))
    assert rms(solution[-1] - solution[0]) < 0.5
    assert solution[-1].max() > 85.0
    assert solution.min() >= 0.0


def test_solution_has_the_symmetry_of_the_gyre():
    """x -> 2 L - x, t -> t + pi / omega maps the flow onto its mirror image; at mu = 0 for all times."""
    left = replace(GYRE, initial=InitialFeature(centre=(60, 40), scale=20))
    right = replace(GYRE, initial=InitialFeature(centre=(140, 40), scale=20))
    np.testing.assert_allclose(left.solve((0.0, 1.0)), right.solve((0.0, 1.0))[:, ::-1], atol=1e-9)
    np.testing.assert_allclose(left.solve((0.3, 1.0)), right.solve((-0.3, 1.0))[:, ::-1], atol=1e-9)


def test_the_equation_is_linear_in_its_initial_feature():
    one = GYRE.solve((0.3, 1.0))
    five = replace(GYRE, initial=InitialFeature(500.0, (60.0, 40.0), 20.0)).solve((0.3, 1.0))
    np.testing.assert_allclose(five, 5 * one, atol=1e-9)


def test_a_flow_without_factors_gives_the_same_solution():
    @dataclass(frozen=True)
    class Plain:
        gyre: DoubleGyre = field(default_factory=DoubleGyre)
        names = ("mu", "omega")
        units = ("1", "rad/time")

        def velocity(self, theta, positions, time):
            return self.gyre.velocity(theta, positions, time)

        def streamfunction(self, theta, positions, time):
            return self.gyre.streamfunction(theta, positions, time)

    np.testing.assert_allclose(
        replace(GYRE, flow=Plain()).solve((0.3, 1.0)), GYRE.solve((0.3, 1.0)), atol=1e-9
    )


OBSTACLES = [
    (Circle((120.0, 50.0), 15.0),),
    (Rectangle((90.0, 0.0), (110.0, 40.0)),),
    (Circle((150.0, 60.0), 12.0), Rectangle((20.0, 60.0), (60.0, 70.0))),
]


@pytest.mark.parametrize("positive", [False, True])
@pytest.mark.parametrize("obstacles", OBSTACLES)
def test_obstacles_let_nothing_in_and_keep_the_mass(obstacles, positive):
    domain = Domain(upper=(200.0, 100.0), obstacles=obstacles)
    model = replace(GYRE, domain=domain, cells=(80, 40), positive=positive)
    solution = model.solve((0.25, 0.6))
    mass = solution.sum(axis=(1, 2))
    np.testing.assert_allclose(mass, mass[0], rtol=1e-12)
    assert not solution[:, model._scheme.solid].any()
    assert solution.min() > (-3.0 if not positive else -1e-300)


@pytest.mark.parametrize("obstacles", OBSTACLES)
def test_no_water_crosses_an_obstacle(obstacles):
    scheme = replace(GYRE, domain=Domain(upper=(200.0, 100.0), obstacles=obstacles), cells=(80, 40))._scheme
    psi = scheme.streamfunction(np.array([0.25, 0.6]), np.array([0.0, 1.3]))
    u, v, solid = np.diff(psi, axis=2), np.diff(psi, axis=1), scheme.solid
    assert not u[:, 1:][:, solid].any()
    assert not u[:, :-1][:, solid].any()
    assert not v[:, :, 1:][:, solid].any()
    assert not v[:, :, :-1][:, solid].any()


def test_flow_far_from_an_obstacle_is_hardly_changed():
    domain = Domain(upper=(200.0, 100.0), obstacles=(Circle((150.0, 50.0), 5.0),))
    theta, times = np.array([0.25, 0.6]), np.array([1.0])
    plain, bent = (
        replace(GYRE, domain=d, cells=(80, 40))._scheme.streamfunction(theta, times) for d in (BASIN, domain)
    )
    assert np.abs(plain - bent)[:, :40].max() < 0.02 * np.abs(plain).max()
