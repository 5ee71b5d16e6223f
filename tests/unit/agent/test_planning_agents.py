"""Agents that plan from a situation: in a search, and against what they promise."""

import numpy as np
import pytest

from fieldrl.agent.gradient import Gradient
from fieldrl.agent.greedy_information import GreedyInformation
from fieldrl.agent.oracle import Oracle
from fieldrl.agent.planner import Planner
from fieldrl.agent.planning import cross_entropy, expected_error, uniform
from fieldrl.agent.situation import Situation
from fieldrl.core.checks import InvalidValue
from fieldrl.core.domain import Domain
from fieldrl.core.information import uncertainty
from fieldrl.core.samples import Samples
from fieldrl.core.streams import stream
from fieldrl.pde.advection import Advection
from fieldrl.pde.initial import InitialFeature
from fieldrl.vehicle.unicycle import Unicycle

TRUE = np.array([1.0, -1.5])
AGENTS = [
    Gradient(), GreedyInformation(), Oracle(population=64, iterations=8, restarts=1),
    Planner(particles=4, population=32, iterations=3),
]  # fmt: skip


@pytest.fixture(scope="module")
def water():
    feature = InitialFeature(scale=20.0, centre=(90.0, 80.0))
    bounds = {"true": tuple(TRUE), "lower": (-3.0, -3.0), "upper": (3.0, 3.0)}
    return Advection(initial=feature, domain=Domain((0.0, 0.0), (200.0, 200.0)), **bounds)


VEHICLE = Unicycle(start=(20.0, 80.0), heading_limits=None)


def situation(water, theta=TRUE, state=None, samples=None, left=12):
    samples = Samples.none() if samples is None else samples
    state = VEHICLE.initial() if state is None else state
    return Situation(water, VEHICLE, samples, theta, TRUE, 1.0, state, float(len(samples)), left)


def information_of(agent, water, steps=12, seed=0):
    """sqrt(tr F^-1 / p) at the truth after a mission in which the estimate is the truth."""
    state, rng = agent.begin(np.zeros(4), np.ones(4), 7), stream(seed, "test")
    pose, samples = VEHICLE.initial(), Samples.none()
    for i in range(steps):
        action = agent.plan(state, situation(water, TRUE, pose, samples, steps - i), rng)
        assert type(action) is int
        pose = VEHICLE.step(pose, action, float(i), water.flow, TRUE, water.domain)
        value = water.predict(TRUE[None], pose[None, :2], np.array([i + 1.0]))[0, 0]
        samples = samples.append(pose[:2], i + 1.0, value + rng.normal())
    return expected_error(situation(water, TRUE, pose, samples, 0), np.empty((1, 0), int), TRUE[None])[0]


def test_a_planned_path_is_the_path_that_is_driven(water):
    plan = np.array([[0, 3, 3, 1, 2, 6, 5]])
    pose, driven = VEHICLE.initial(), []
    for i, action in enumerate(plan[0]):
        pose = VEHICLE.step(pose, int(action), float(i), water.flow, TRUE, water.domain)
        driven.append(pose[:2])
    positions, times = situation(water).paths(plan, np.stack([TRUE, -TRUE]))
    assert positions.shape == (2, 1, 7, 2)
    assert np.allclose(positions[0, 0], driven, atol=1e-3)
    assert np.array_equal(times, np.arange(1.0, 8.0))


@pytest.mark.parametrize("agent", AGENTS[1:], ids=lambda agent: type(agent).__name__)
def test_who_seeks_information_finds_it(agent, water):
    assert information_of(agent, water) < 0.05


def test_who_climbs_straight_to_the_top_learns_one_unknown_of_two(water):
    assert information_of(AGENTS[0], water) == pytest.approx(np.sqrt(0.5), abs=0.01)


def test_no_agent_knows_more_than_the_oracle(water):
    errors = [information_of(agent, water) for agent in AGENTS]
    assert min(errors) >= 0.97 * errors[2]  # it searches, and so may miss the best by little


def test_the_same_stream_gives_the_same_plan(water):
    def chosen(seed):
        return [
            agent.plan(agent.begin(np.zeros(4), np.ones(4), 7), situation(water), stream(seed, "test"))
            for agent in AGENTS
        ]

    assert chosen(1) == chosen(1)


def test_only_the_oracle_looks_at_the_truth(water):
    other = situation(water, theta=np.zeros(2))
    blind = Situation(**{**vars(other), "truth": np.full(2, np.nan)})
    for agent in (AGENTS[0], AGENTS[1], AGENTS[3]):
        state = agent.begin(np.zeros(4), np.ones(4), 7)
        assert agent.plan(state, blind, stream(0, "test")) == agent.plan(
            agent.begin(np.zeros(4), np.ones(4), 7), other, stream(0, "test")
        )


def test_the_cross_entropy_method_finds_the_cheapest_plan():
    wanted = np.array([3, 0, 6, 2, 2, 5])
    found = cross_entropy(
        lambda plans: (plans != wanted).sum(axis=1).astype(float), uniform(6, 7), stream(0, "test"), 128, 12
    )
    assert np.array_equal(found, wanted)


@pytest.mark.parametrize("seed", range(4))
def test_the_planner_s_action_serves_all_particles_best(water, seed):
    thetas = stream(seed, "particles").uniform(-3, 3, (3, 2))
    pose = np.array([70.0, 80.0, 0.0])
    here = situation(water, state=pose, left=2)
    plans = np.stack(np.meshgrid(np.arange(7), np.arange(7), indexing="ij"), axis=-1).reshape(-1, 2)
    left = uncertainty(here.information(plans, thetas)).reshape(3, 7, 7)
    worth = left.min(axis=2).mean(axis=0)

    class Told(Planner):
        def _particles(self, situation, rng):
            return thetas

    planner = Told(population=128)
    action = planner.plan(planner.begin(np.zeros(4), np.ones(4), 7), here, stream(seed, "test"))
    assert worth[action] == worth.min()
    assert worth.max() > 1.02 * worth.min()


def test_particles_are_draws_from_the_posterior(water):
    rng = stream(0, "test")
    positions, times = np.array([[90.0, 95.0], [110.0, 60.0], [80.0, 70.0]]), np.array([1.0, 2.0, 3.0])
    values = water.predict(TRUE[None], positions, times)[0]
    here = situation(water, samples=Samples.of(positions, times, values))
    drawn = Planner(particles=4000, proposals=40_000)._particles(here, rng)
    axis = np.linspace(-3, 3, 301)
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    misfit = np.sum((water.predict(grid, positions, times) - values) ** 2, axis=1)
    weight = np.exp(-0.5 * misfit)
    mean = weight @ grid / weight.sum()
    deviation = np.sqrt(weight @ (grid - mean) ** 2 / weight.sum())
    assert np.allclose(drawn.mean(axis=0), mean, atol=0.15 * deviation.max())
    assert np.allclose(drawn.std(axis=0), deviation, rtol=0.15)


@pytest.mark.parametrize(
    ("agent", "key"),
    [
        (Planner, "particles"),
        (Planner, "population"),
        (Planner, "horizon"),
        (Oracle, "iterations"),
        (Oracle, "restarts"),
    ],
)
def test_a_plan_needs_some_of_each(agent, key):
    with pytest.raises(InvalidValue, match=key):
        agent(**{key: 0})
