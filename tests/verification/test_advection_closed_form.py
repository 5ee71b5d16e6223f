"""The closed form against integration along the characteristic, quadrature and differences."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from fieldrl.pde.advection import Advection
from fieldrl.pde.initial import InitialFeature
from fieldrl.pde.source import LocalisedSource

SOURCES = {
    "always open": LocalisedSource(5.0, (80.0, 90.0), 15.0),
    "window": LocalisedSource(3.0, (60.0, 70.0), 20.0, opens=2.0, closes=5.5),
    "sink": LocalisedSource(-4.0, (90.0, 60.0), 12.0, opens=1.0),
    "narrow": LocalisedSource(50.0, (75.0, 75.0), 1.5),
}
sources = pytest.mark.parametrize("source", SOURCES.values(), ids=SOURCES.keys())


def feature_by_hand(x: float, y: float, a: float, cx: float, cy: float, scale: float, q: float) -> float:
    return a * math.exp(-((abs(x - cx) / scale) ** q) - (abs(y - cy) / scale) ** q)


def rate_by_hand(source: LocalisedSource, x: float, y: float) -> float:
    (cx, cy), width = source.centre, source.width
    return source.strength * math.exp(-((x - cx) ** 2 + (y - cy) ** 2) / width**2)


def along_the_characteristic(model: Advection, b, position, time: float) -> float:
    """df/ds = g along dx/ds = b, by Runge-Kutta of order 8, in the pieces of g's window."""
    feature, source, (x, y) = model.initial, model.source, position
    start = x - time * b[0], y - time * b[1]
    state = np.array([*start, feature_by_hand(*start, *feature.constants)])
    closes = math.inf if source is None or source.closes is None else source.closes
    cuts = sorted({0.0, time, *(min(time, cut) for cut in (source.opens if source else 0.0, closes))})
    for begin, end in pairwise(cuts):
        open_ = source is not None and source.opens <= begin < closes

        def slope(_, z, open_=open_):
            return [b[0], b[1], rate_by_hand(source, z[0], z[1]) if open_ else 0.0]

        solved = solve_ivp(slope, (begin, end), state, "DOP853", rtol=1e-12, atol=1e-13, max_step=0.2)
        state = solved.y[:, -1]
    np.testing.assert_allclose(state[:2], position, atol=1e-9)
    return state[2]


def duhamel_by_quadrature(source: LocalisedSource, b, position, time: float) -> float:
    """Eq. (2)'s integral by adaptive quadrature between the times at which the source opens and closes."""
    end = time if source.closes is None else min(time, source.closes)
    if end <= source.opens:
        return 0.0

    def rate(s: float) -> float:
        return rate_by_hand(source, position[0] + (s - time) * b[0], position[1] + (s - time) * b[1])

    speed2 = b[0] ** 2 + b[1] ** 2
    offset = np.subtract(source.centre, position)
    nearest = time + float(offset @ b) / speed2 if speed2 else 0.5 * end
    peak = [min(max(nearest, source.opens), end)]
    cuts = sorted({source.opens, *peak, end})
    return sum(
        quad(rate, begin, stop, epsabs=0.0, epsrel=1e-12, limit=400)[0] for begin, stop in pairwise(cuts)
    )


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 2.7, 4.0])
def test_the_closed_form_is_the_initial_feature_integrated_along_the_characteristic(exponent):
    rng = np.random.default_rng(int(10 * exponent))
    for _ in range(8):
        feature = InitialFeature(
            rng.uniform(-200, 200), rng.uniform(0, 200, 2), rng.uniform(10, 80), exponent
        )
        model, b, time = Advection(feature), rng.uniform(-15, 15, 2), rng.uniform(0, 20)
        position = np.array(feature.centre) + time * b + rng.uniform(-1.5, 1.5, 2) * feature.scale
        expected = along_the_characteristic(model, b, position, time)
        predicted = model.predict(b[None], position[None], np.array([time]))[0, 0]
        assert predicted == pytest.approx(expected, rel=1e-9)


@sources
def test_with_a_source_the_closed_form_is_the_characteristic_s_integral(source):
    rng, model = np.random.default_rng(3), Advection(source=source)
    for _ in range(6):
        b, time = rng.uniform(-8, 8, 2), rng.uniform(3, 12)
        position = np.array(source.centre) + 0.5 * time * b + rng.uniform(-1, 1, 2) * source.width
        expected = along_the_characteristic(model, b, position, time)
        predicted = model.predict(b[None], position[None], np.array([time]))[0, 0]
        assert predicted == pytest.approx(expected, rel=1e-8)


FLOWS = {"none": (0.0, 0.0), "slow": (0.01, -0.02), "usual": (5.0, 5.0), "fast": (-15.0, 14.0)}


@sources
@pytest.mark.parametrize("b", FLOWS.values(), ids=FLOWS.keys())
def test_duhamel_s_integral_is_that_of_adaptive_quadrature(source, b):
    model, b = Advection(source=source), np.array(b)
    rng, compared = np.random.default_rng(5), 0
    for time in (0.5, 3.0, 5.5, 8.0, 20.0):
        position = np.array(source.centre) + 0.6 * time * b + rng.uniform(-1, 1, 2) * source.width
        expected = duhamel_by_quadrature(source, b, position, time)
        feature = model.initial.value((position - time * b)[None])[0]
        added = model.predict(b[None], position[None], np.array([time]))[0, 0] - feature
        assert added == pytest.approx(expected, rel=1e-9, abs=1e-13 * abs(feature) + 1e-15)
        compared += abs(expected) > 1e-3
    assert compared >= 2


def test_a_source_opening_after_the_sample_adds_nothing():
    closed = Advection(source=LocalisedSource(5.0, (80.0, 90.0), 15.0, opens=10.0))
    what = np.array([[1.0, 1.0]]), np.array([[80.0, 90.0]]), np.array([9.9])
    assert closed.predict(*what)[0, 0] == Advection().predict(*what)[0, 0]


def test_still_water_above_a_source_fills_up_at_its_rate():
    model = Advection(
        InitialFeature(centre=(0.0, 0.0), scale=1.0), LocalisedSource(2.0, (100.0, 100.0), 10.0)
    )
    filled = model.predict(np.zeros((1, 2)), np.array([[100.0, 100.0]]), np.array([7.0]))[0, 0]
    assert filled == pytest.approx(14.0, rel=1e-13)


def difference_errors(model: Advection, b, positions, times, steps):
    """Largest error of central differences against the Jacobian, for each step."""
    slopes = model.jacobian(b[None], positions, times)[0]
    worst = []
    for step in steps:
        shifts = step * np.eye(2)
        ahead, behind = (model.predict(b + sign * shifts, positions, times) for sign in (1, -1))
        worst.append(np.abs((ahead - behind).T / (2 * step) - slopes).max())
    return np.array(worst)


CASES = {
    "q=2": Advection(),
    "q=1.5": Advection(InitialFeature(exponent=1.5)),
    "q=4": Advection(InitialFeature(exponent=4.0)),
    **{f"source, {name}": Advection(source=source) for name, source in SOURCES.items() if name != "narrow"},
}


@pytest.mark.parametrize("model", CASES.values(), ids=CASES.keys())
def test_central_differences_approach_the_jacobian_with_order_two(model):
    rng, b = np.random.default_rng(2), np.array([5.0, 4.0])
    times = rng.uniform(2, 10, 12)
    positions = (50.0, 50.0) + times[:, None] * b + rng.choice([-1, 1], (12, 2)) * rng.uniform(5, 30, (12, 2))
    steps = np.array([8e-3, 4e-3, 2e-3, 1e-3])
    found = difference_errors(model, b, positions, times, steps)
    order = np.polyfit(np.log(steps), np.log(found), 1)[0]
    assert order == pytest.approx(2.0, abs=0.05)
    assert found[-1] < 1e-3


@sources
def test_the_jacobian_of_the_source_term_holds_where_it_matters(source):
    model = Advection(InitialFeature(centre=(-500.0, -500.0), scale=1.0), source)
    rng, b = np.random.default_rng(4), np.array([4.0, -3.0])
    times = rng.uniform(3, 9, 10)
    positions = (
        np.array(source.centre) + 0.4 * times[:, None] * b + rng.uniform(-1, 1, (10, 2)) * source.width
    )
    found = difference_errors(model, b, positions, times, [1e-5])
    assert found[0] < 1e-7 * np.abs(model.jacobian(b[None], positions, times)).max()


def test_still_water_has_derivatives_by_the_flow_too():
    model = Advection(source=SOURCES["always open"])
    positions, times = np.array([[70.0, 80.0], [85.0, 95.0]]), np.array([3.0, 6.0])
    assert difference_errors(model, np.zeros(2), positions, times, [1e-5])[0] < 1e-6
