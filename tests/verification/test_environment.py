"""The environment keeps Gymnasium's contract, and its own."""

from __future__ import annotations

import math

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from fieldrl.core.checks import FieldrlError
from fieldrl.core.domain import Circle, Domain, Rectangle
from fieldrl.estimator.least_squares import LeastSquares
from fieldrl.mission.environment import FieldSampling
from fieldrl.pde.advection import Advection
from fieldrl.reward.total_error import TotalError
from fieldrl.vehicle.sensor import Sensor
from fieldrl.vehicle.unicycle import Unicycle

OBSTACLES = [Circle((60.0, 60.0), 15.0), Rectangle((90.0, 80.0), (110.0, 140.0))]
VAGUE = Sensor(covariance=(400.0, 400.0, 4.0))


def environment(
    steps: int = 5, vehicle: Unicycle | None = None, domain: Domain | None = None
) -> FieldSampling:
    water = Advection(domain=domain or Domain())
    return FieldSampling(water, vehicle or Unicycle(), LeastSquares(), TotalError(), steps)


def episode(env, seed: int | None, actions) -> list[tuple]:
    """What a fixed plan sees: observation, reward, value at each step."""
    seen = [env.reset(seed=seed)[0].tolist()]
    for action in actions:
        observation, reward, _, _, info = env.step(action)
        seen.append((observation.tolist(), reward, info["value"], info["theta"].tolist()))
    return seen


@pytest.mark.parametrize(
    "vehicle",
    [Unicycle(), Unicycle(sensor=VAGUE), Unicycle(heading_limits=None, sensor=VAGUE)],
    ids=["exact", "vague", "no heading limits"],
)
def test_gymnasium_s_checker_finds_nothing_to_say(vehicle):
    check_env(environment(vehicle=vehicle), skip_render_check=True)


def test_the_same_seed_repeats_an_episode_exactly():
    plan, env = [0, 3, 1, 5, 6], environment(vehicle=Unicycle(sensor=VAGUE))
    first = episode(env, 7, plan)
    episode(env, None, plan)
    assert episode(env, 7, plan) == first
    assert episode(environment(vehicle=Unicycle(sensor=VAGUE)), 7, plan) == first


def test_other_seeds_and_unseeded_resets_see_other_noise():
    plan, env = [0, 3, 1, 5, 6], environment()
    values = [[step[2] for step in episode(env, seed, plan)[1:]] for seed in (7, 8, None, None)]
    assert len({value for row in values for value in row}) == 20


def test_an_episode_ends_with_its_last_sample_and_never_by_truncation():
    env = environment(steps=4)
    env.reset(seed=0)
    ends = [env.step(0)[2:4] for _ in range(4)]
    assert ends == [(False, False)] * 3 + [(True, False)]


def test_a_step_after_the_end_is_refused_until_the_next_reset():
    env = environment(steps=1)
    env.reset(seed=0)
    env.step(0)
    with pytest.raises(FieldrlError, match="reset"):
        env.step(0)
    env.reset()
    assert env.step(0)[2]


@pytest.mark.parametrize("action", [-1, 7, 100])
def test_an_unknown_action_is_refused_and_moves_nothing(action):
    env = environment()
    env.reset(seed=0)
    with pytest.raises(FieldrlError, match=f"action={action}"):
        env.step(action)
    assert len(env.samples) == 0
    assert env.state.tolist() == [20.0, 20.0, 0.0]


@pytest.mark.parametrize("limits", [(-math.pi / 4, math.pi / 4), None], ids=["limits", "none"])
def test_measurements_however_vague_stay_within_the_observation_space(limits):
    env = environment(20, Unicycle(sensor=VAGUE, heading_limits=limits))
    for seed in range(10):
        observation, _ = env.reset(seed=seed)
        assert env.observation_space.contains(observation)
        rng = np.random.default_rng(seed)
        for _ in range(20):
            observation = env.step(int(rng.integers(7)))[0]
            assert env.observation_space.contains(observation)


def test_without_heading_limits_a_measured_heading_wraps_round():
    west = Unicycle(heading=math.pi, heading_limits=None, sensor=Sensor(covariance=(0.0, 0.0, 0.01)))
    env = environment(vehicle=west)
    headings = np.array([env.reset(seed=seed)[0][2] for seed in range(200)])
    assert np.all(np.abs(headings) <= math.pi)
    assert not np.any(np.abs(headings) == math.pi)
    assert 60 < np.sum(headings < 0) < 140
    assert np.abs(headings).min() > math.pi - 0.6


def test_info_tells_what_happened_and_nothing_it_should_not():
    env = environment()
    assert env.reset(seed=0)[1] == {}
    observation, _, _, _, info = env.step(0)
    np.testing.assert_allclose(info["position"], (35.0, 25.0), atol=1e-9)
    assert info["heading"] == 0.0
    assert info["time"] == observation[3] == 1.0
    assert info["theta"].shape == (2,)
    assert info["e_total"] == info["e_f"] + info["e_cv"]
    assert info["evaluations"] > 0
    assert observation[:2].tolist() == info["position"].tolist()
    clean = env.truth.predict(np.array([[5.0, 5.0]]), info["position"][None], np.array([1.0]))[0, 0]
    assert 0 < abs(info["value"] - clean) < 5.0


def test_the_fit_sees_measured_positions_while_the_field_is_probed_at_true_ones():
    env = environment(20, Unicycle(sensor=Sensor(noise=0.0, covariance=(9.0, 9.0, 0.0))))
    env.reset(seed=1)
    for _ in range(5):
        observation, _, _, _, info = env.step(0)
        at = np.array([info["time"]])
        assert env.samples.positions[-1].tolist() == observation[:2].tolist()
        assert not np.any(observation[:2] == info["position"])
        assert info["value"] == env.truth.predict(env.theta[None], info["position"][None], at)[0, 0]


def test_the_fit_is_given_a_position_beyond_the_wall_as_it_was_measured():
    at_the_wall = Unicycle(start=(0.0, 100.0), sensor=Sensor(covariance=(25.0, 25.0, 0.0)))
    env, beyond = environment(20, at_the_wall), 0
    for seed in range(10):
        env.reset(seed=seed)
        observation, _, _, _, info = env.step(6)
        fitted = env.samples.positions[-1]
        assert observation[:2].tolist() == np.clip(fitted, 0.0, 200.0).tolist()
        assert info["measured_position"].tolist() == fitted.tolist()
        beyond += fitted[0] < 0
    assert beyond > 0


def test_the_vehicle_is_never_inside_an_obstacle_nor_outside_the_walls():
    domain, touched = Domain(obstacles=OBSTACLES), 0
    env = environment(20, Unicycle(heading_limits=None), domain)
    for seed in range(12):
        env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        for _ in range(20):
            position = env.step(int(rng.integers(7)))[4]["position"]
            assert domain.contains(position[None])[0]
            touched += abs(math.dist(position, (60.0, 60.0)) - 15.0) < 1e-3
    assert touched > 0


def test_a_seeded_reset_forgets_what_was_solved_and_an_unseeded_one_keeps_it():
    env = environment()
    env.reset(seed=0)
    env.known = np.ones((3, 2))
    env.reset()
    assert env.known.shape == (3, 2)
    env.reset(seed=0)
    assert env.known.shape == (0, 2)


def test_anyone_can_make_the_registered_environment():
    env = gymnasium.make("fieldrl/Advection-v0")
    check_env(env.unwrapped, skip_render_check=True)  # "human" needs a screen
    assert env.action_space.n == 7
    observation, _ = env.reset(seed=0)
    assert observation.tolist() == [20.0, 20.0, 0.0, 0.0]
    terminated = [env.step(0)[2] for _ in range(20)]
    assert terminated == [False] * 19 + [True]


def test_a_registered_environment_takes_overrides_as_the_command_line_does():
    env = gymnasium.make("fieldrl/Advection-v0", overrides=["steps=3", "vehicle.start=[50,60]"])
    assert env.reset(seed=0)[0].tolist() == [50.0, 60.0, 0.0, 0.0]
    assert [env.step(0)[2] for _ in range(3)] == [False, False, True]
