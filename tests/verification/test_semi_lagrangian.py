"""Does another method than finite volumes find the same field? Its order, exact limits, agreement."""

from dataclasses import replace

import numpy as np
import pytest

from fieldrl.core.checks import InvalidValue, SolveFailed
from fieldrl.core.domain import Circle, Domain
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.flow import UniformFlow
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.source import LocalisedSource

THETA = (0.25, 0.6)
SMOOTH = AdvectionDiffusion(
    initial=InitialFeature(centre=(70.0, 45.0), scale=25.0),
    diffusivity=20.0,
    cells=(112, 56),
    final_time=2.0,
    interval=2.0,
)
POINTS = SMOOTH.domain.grid(40, 20)


def semi_lagrangian(nx: int, model: AdvectionDiffusion = SMOOTH) -> AdvectionDiffusion:
    return replace(model, scheme="semi_lagrangian", cells=(nx, nx // 2))


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_its_order_is_two_and_it_converges_to_the_field_of_the_finite_volumes():
    """The step follows the cells, so one slope tells of time and space together."""
    reference = SMOOTH.field(THETA, 2.0, POINTS)
    sizes = np.array([36, 52, 72, 104])
    errors = [rms(semi_lagrangian(n).field(THETA, 2.0, POINTS) - reference) for n in sizes]
    order = np.polyfit(np.log(1 / sizes), np.log(errors), 1)[0]
    assert 1.8 < order < 2.6
    assert errors[-1] < 2e-3 * reference.max()


def test_with_the_paper_s_settings_the_two_methods_agree_to_a_hundredth_of_the_noise():
    model = AdvectionDiffusion(cells=(142, 71), final_time=3.0, interval=3.0)
    ours, other = (each.field(THETA, 3.0, POINTS) for each in (model, semi_lagrangian(200, model)))
    assert rms(ours - other) < 1e-3
    assert abs(ours - other).max() < 1e-2


def test_diffusion_in_still_water_is_exact():
    """Cosines are the solutions between closed walls; a cell average of one is its value times a sinc."""
    (nx, ny), rho, time = (24, 12), 3.0, 2.0

    class Cosine:
        def value(self, positions):
            x, y = np.asarray(positions).T
            return 5.0 + np.cos(np.pi * x / 200.0) * np.cos(2 * np.pi * y / 100.0)

    model = AdvectionDiffusion(
        flow=UniformFlow(), initial=Cosine(), true=(0, 0), lower=(-1, -1), upper=(1, 1), diffusivity=rho,
        cells=(nx, ny), final_time=time, scheme="semi_lagrangian",
    )  # fmt: skip
    start, end = model.solve((0.0, 0.0))[[0, -1]]
    decay = np.exp(-rho * time * ((np.pi / 200.0) ** 2 + (2 * np.pi / 100.0) ** 2))
    np.testing.assert_allclose(end - 5.0, decay * (start - 5.0), atol=1e-6)


def test_uniform_water_carries_the_feature_to_where_it_belongs():
    domain = Domain(upper=(200.0, 200.0))
    model = AdvectionDiffusion(
        flow=UniformFlow(), initial=InitialFeature(centre=(80.0, 90.0), scale=20.0), true=(8.0, 3.0),
        lower=(-9, -9), upper=(9, 9), diffusivity=1.0, domain=domain, cells=(100, 100), final_time=3.0,
        scheme="semi_lagrangian",
    )  # fmt: skip
    grid = domain.grid(50, 50)
    spread = 20.0**2 + 4 * 3.0
    square = np.sum((grid.points - (104.0, 99.0)) ** 2, axis=1)
    exact = 100 * 20.0**2 / spread * np.exp(-square / spread)
    np.testing.assert_allclose(model.field((8.0, 3.0), 3.0, grid).ravel(), exact, atol=2e-2)


def test_a_source_gives_what_it_releases():
    source = LocalisedSource(5.0, (100.0, 50.0), 15.0)
    model = replace(SMOOTH, source=source, cells=(96, 48))
    ours, other = (each.field(THETA, 2.0, POINTS) for each in (model, semi_lagrangian(96, model)))
    assert rms(ours - other) < 0.02 * rms(ours)


def test_what_it_cannot_do_is_refused():
    domain = Domain(upper=(200.0, 100.0), obstacles=[Circle((100.0, 50.0), 10.0)])
    for impossible in ({"domain": domain}, {"positive": True}):
        with pytest.raises(InvalidValue, match=r"scheme=.*neither obstacles nor positive.*finite_volumes"):
            replace(SMOOTH, scheme="semi_lagrangian", **impossible)


def test_a_flow_without_end_is_a_failed_solve():
    class Exploding(UniformFlow):
        def velocity(self, theta, positions, time):
            return np.full((len(positions), 2), np.inf if time > 1 else 0.0)

    model = AdvectionDiffusion(
        flow=UniformFlow(),
        true=(0, 0),
        lower=(-1, -1),
        upper=(1, 1),
        cells=(48, 24),
        scheme="semi_lagrangian",
    )
    object.__setattr__(model, "flow", Exploding())
    with pytest.raises(SolveFailed):
        model.solve((0.0, 0.0))
