"""The diagnosis: its controls, its variances, its counts, each against what is known."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from fieldrl.agent.random import Random
from fieldrl.agent.sarsa_lambda import SarsaLambda
from fieldrl.core.streams import stream
from pipelines.diagnosis import chain, coverage, learners, measured, returns
from pipelines.diagnosis.cases import CONTROLS, Case, Place, runs
from pipelines.diagnosis.distance import Distance

SETTINGS = Place(scale="small", jobs=1)


@pytest.fixture(scope="module")
def task():
    """A short mission."""
    return replace(Case(("estimator.starts=1",)).mission(SETTINGS), steps=8)


def layout(path, noise, both, size=(400, 300)):
    """Returns with known deviations."""
    rng = stream(0, "test")
    k, m = size
    return (
        60 + path * rng.normal(size=(k, 1)) + noise * rng.normal(size=(1, m)) + both * rng.normal(size=size)
    )


def paid(task, reward, path):
    """Rewards along a path, and the environment at its end."""
    environment = replace(task, reward=reward).environment()
    environment.np_random = stream(0, "test")
    environment.reset()
    return np.array([environment.step(action)[1] for action in path]), environment


def test_the_variances_of_a_layout_are_found():
    found = returns.parts(layout(3.0, 20.0, 10.0))
    assert np.sqrt([found.path, found.noise, found.both]) == pytest.approx([3.0, 20.0, 10.0], rel=0.12)
    assert found.share == pytest.approx(9 / 509, rel=0.2)
    assert found.effect == pytest.approx(3 / np.sqrt(500), rel=0.12)


def test_a_layout_of_nothing_but_noise_has_no_effect_of_the_path():
    low, _ = returns.effect_interval(layout(0.0, 20.0, 10.0, (60, 60)))
    assert returns.parts(layout(0.0, 20.0, 10.0)).effect < 0.03
    assert low == pytest.approx(0.0, abs=0.03)


def test_so_many_episodes_tell_a_path_from_the_mean_four_times_in_five():
    episodes = round(returns.Parts(1.0, 9.0, 0.0).episodes)
    rng = stream(0, "test")
    means = rng.normal(1.0, 3.0, size=(4000, episodes)).mean(axis=1)
    assert np.mean(means > 1.645 * 3.0 / np.sqrt(episodes)) == pytest.approx(0.8, abs=0.03)


def test_every_path_has_the_same_noise_and_leads_where_the_environment_says(task):
    path = returns.any_paths(task, 3)[1]
    one, other = returns.play(task, np.array([path, path]), range(3)).swapaxes(0, 1)
    np.testing.assert_array_equal(one, other)
    _, environment = paid(task, task.reward, path)
    np.testing.assert_array_equal(returns.places(task, path[None])[0], environment.samples.positions)


def test_the_best_path_is_found_by_its_mean_with_new_noise_in_each_round(task, monkeypatch):
    asked = []

    def play(task, paths, draws):
        asked.append((len(paths), draws))
        noise = np.array([stream(draw, "test").normal(size=10) for draw in draws]).T[paths[:, 0]]
        return np.stack([paths[:, :1] + noise, np.zeros_like(noise)])

    monkeypatch.setattr(returns, "play", play)
    best = returns.best(task, np.arange(10)[:, None], ((20, 4), (200, 1)))
    assert best.tolist() == [9]
    assert asked == [(10, range(20)), (4, range(20, 220))]


def test_a_control_pays_for_nearness_at_every_step_or_the_same_at_the_end(task):
    path = returns.any_paths(task, 1)[0]
    each, environment = paid(task, Distance(20.0), path)
    late, _ = paid(task, Distance(20.0, delayed=True), path)
    far = learners.distances(task, environment.samples.positions)
    assert each.sum() == pytest.approx(20.0 * (1 - far / 100))
    assert late[-1] == pytest.approx(each.sum())
    assert not late[:-1].any()


def test_the_noise_of_a_control_is_what_eq_19_pays_who_knows_the_flow(task):
    path = np.full(8, 6)  # within the feature
    noisy, environment = paid(task, Distance(noisy=True), path)
    plain, _ = paid(task, Distance(), path)
    samples = environment.samples
    true = np.array(task.water.parameters.true)[None]
    error = samples.values - task.water.predict(true, samples.positions, samples.times)[0]
    assert (noisy - plain)[-1] == pytest.approx(50 / np.mean(error**2))
    assert not (noisy - plain)[:-1].any()


def test_the_deviation_of_that_noise_is_known():
    drawn = 50 / np.mean(stream(0, "test").normal(size=(200_000, 20)) ** 2, axis=1)
    assert measured.noise(20) == pytest.approx(drawn.std(), rel=0.02)


def test_the_shipped_agent_learns_the_row_without_noise_and_a_random_one_does_not():
    learner, random = (
        chain.ends(agent, 100.0, 0.0, 0, 300)[-100:].mean() for agent in (SarsaLambda(), Random())
    )
    assert learner > 0.85
    assert random == pytest.approx(0.53, abs=0.06)


def test_coverage_counts_cells_and_pairs(task):
    paths = returns.any_paths(task, 40)
    reach = returns.places(task, paths)
    record = xr.Dataset(
        {
            "position": (
                ("replicate", "episode", "step", "axis"),
                np.stack([reach, reach[:1].repeat(40, 0)]),
            ),
            "action": (("replicate", "episode", "step"), np.stack([paths, paths[:1].repeat(40, 0)])),
        }
    )
    all_of_it, one_path = coverage.of_water(task, record, reach, 1)
    assert all_of_it == 1.0
    assert one_path == np.sum(coverage.visits(task, reach[0]) > 0) / np.sum(coverage.visits(task, reach) > 0)
    pairs = coverage.of_table(task, record, reach, 1)
    assert 1 / 7 < pairs[0] < 1
    assert pairs[1] < pairs[0]


def test_value_functions_agree_where_they_are_the_same_and_not_where_they_are_noise():
    rng = stream(0, "test")
    same = np.repeat(rng.normal(size=(1, 20, 20)), 3, axis=0)
    same[1, :5] = np.nan  # where one has not been
    assert learners.agreement(same) == pytest.approx(1.0)
    assert abs(learners.agreement(rng.normal(size=(6, 20, 20)))) < 0.1
    assert learners.agreement(np.full((2, 20, 20), np.nan)) == 0.0


def test_a_learner_has_values_only_where_it_has_been(task):
    run = learners._learn(replace(task, episodes=2), 0)
    found = learners.value(task, run)
    assert np.isfinite(found).sum() == np.sum(learners._seen(task, run)) > 0


def test_cases_and_runs_are_missions_that_differ_only_in_what_they_say():
    for case in CONTROLS.values():
        assert isinstance(case.mission(SETTINGS).reward, Distance)
    hopeful = CONTROLS["at the end, noise, size 100, from 200"].mission(SETTINGS)
    assert hopeful.agent.initial_value == 200.0
    assert len(runs(SETTINGS)) == 2 * 5
