"""SARSA(lambda): choice, schedules, the cost of an update, and what it refuses."""

import numpy as np
import pytest

from fieldrl.agent.sarsa_lambda import LearningDiverged, SarsaLambda
from fieldrl.agent.schedules import Exponential, Linear
from fieldrl.agent.tile_coding import TileCoding
from fieldrl.core.checks import InvalidValue
from fieldrl.core.streams import stream

LOW, HIGH = np.zeros(4), np.array([200.0, 200.0, 1.0, 20.0])
HERE, THERE = np.array([30.0, 40.0, 0.0, 0.0]), np.array([170.0, 160.0, 0.0, 1.0])


def begun(agent, actions=7):
    return agent.begin_episode(agent.begin(LOW, HIGH, actions))


def chosen(agent, state, times=7000, greedy=False):
    """How often each action is chosen, (actions,)."""
    rng = stream(0, "test")
    return np.bincount([agent.act(state, HERE, rng, greedy) for _ in range(times)], minlength=7)


def prefer(agent, state, action, value=1.0):
    state["weights"][action, agent.tile_coding.active(HERE, state["coder"])] = value


def test_the_greedy_action_is_taken_with_probability_one_minus_epsilon_and_its_share():
    agent = SarsaLambda(exploration=0.15)
    state = begun(agent)
    prefer(agent, state, 4)
    counts = chosen(agent, state, 20_000) / 20_000
    assert counts[4] == pytest.approx(1 - 0.15 + 0.15 / 7, abs=0.01)
    assert np.delete(counts, 4) == pytest.approx(np.full(6, 0.15 / 7), abs=0.005)


def test_equal_values_are_chosen_equally_often():
    agent = SarsaLambda(exploration=0)
    state = begun(agent)
    prefer(agent, state, 2)
    prefer(agent, state, 5)
    counts = chosen(agent, state)
    assert counts[2] + counts[5] == 7000
    assert counts[2] == pytest.approx(3500, abs=200)


def test_a_new_agent_tries_every_action_alike_even_when_greedy():
    agent = SarsaLambda()
    assert chosen(agent, begun(agent), greedy=True) == pytest.approx(np.full(7, 1000), abs=120)


def test_an_initial_value_is_that_of_every_action_everywhere():
    agent = SarsaLambda(initial_value=200.0)
    state = begun(agent)
    for place in (HERE, THERE):
        values = state["weights"][:, agent.tile_coding.active(place, state["coder"])].sum(axis=1)
        assert values == pytest.approx(np.full(7, 200.0))
    assert np.array_equal(begun(SarsaLambda())["weights"], np.zeros((7, 512)))


@pytest.mark.parametrize(("initial_value", "tried"), [(0.0, 1), (200.0, 7)])
def test_hope_makes_an_agent_try_every_action_where_returns_are_positive(initial_value, tried):
    agent = SarsaLambda(initial_value=initial_value, exploration=0.0)
    state, rng, actions = agent.begin(LOW, HIGH, 7), stream(0, "test"), set()
    for _ in range(20):
        state = agent.begin_episode(state)
        action = agent.act(state, HERE, rng)
        actions.add(action)
        state = agent.learn(state, HERE, action, 60.0, HERE, 0, True)
    assert len(actions) == tried


def test_greedy_never_explores():
    agent = SarsaLambda(exploration=1)
    state = begun(agent)
    prefer(agent, state, 6)
    assert chosen(agent, state, greedy=True)[6] == 7000


@pytest.mark.parametrize("traces", ["replacing", "accumulating", "dutch"])
def test_one_visit_removes_the_step_sizes_share_of_the_error_whatever_the_tilings(traces):
    agent = SarsaLambda(step_size=0.9, traces=traces, tile_coding=TileCoding(tilings=8))
    state = begun(agent)
    prefer(agent, state, 3, 0.25)
    agent.begin_episode(state)
    before = 8 * 0.25
    state["previous_value"][0] = before
    agent.learn(state, HERE, 3, 10.0, THERE, 0, True)
    after = state["weights"][3, agent.tile_coding.active(HERE, state["coder"])].sum()
    assert after == pytest.approx(before + 0.9 * (10 - before))


def test_an_update_touches_the_eligible_features_only():
    agent = SarsaLambda()
    state = begun(agent)
    agent.learn(state, HERE, 3, 10.0, THERE, 1, False)
    agent.learn(state, THERE, 1, 10.0, HERE, 3, True)
    assert np.count_nonzero(state["weights"]) == 16
    assert np.count_nonzero(state["weights"][3]) == np.count_nonzero(state["weights"][1]) == 8


def test_the_eligible_list_names_exactly_the_non_zero_traces():
    agent, rng = SarsaLambda(trace_decay=0.3), stream(1, "test")
    state = begun(agent)
    for _ in range(100):
        seen = rng.uniform(LOW, HIGH, (2, 4))
        agent.learn(state, seen[0], int(rng.integers(7)), 1.0, seen[1], 0, False)
        listed = state["eligible"][: state["eligible_count"][0]]
        assert np.array_equal(np.sort(listed), np.flatnonzero(state["traces"]))


def test_a_trace_decay_of_zero_leaves_no_trace():
    agent = SarsaLambda(trace_decay=0)
    state = begun(agent)
    agent.learn(state, HERE, 3, 10.0, THERE, 1, False)
    assert state["eligible_count"][0] == 0


def test_traces_do_not_reach_into_the_next_episode():
    agent = SarsaLambda()
    state = begun(agent)
    agent.learn(state, HERE, 3, 10.0, THERE, 1, False)
    agent.begin_episode(state)
    assert not state["traces"].any()
    assert state["eligible_count"][0] == 0


def test_the_table_is_allocated_once():
    agent = SarsaLambda()
    state = begun(agent)
    table = state["weights"]
    for _ in range(3):
        state = agent.begin_episode(state)
        state = agent.learn(state, HERE, 3, 10.0, THERE, 1, True)
    assert state["weights"] is table
    assert table.shape == (7, 512)


def test_the_next_action_of_a_terminal_step_does_not_matter():
    agent = SarsaLambda()
    one, other = begun(agent), begun(agent)
    agent.learn(one, HERE, 3, 10.0, THERE, 0, True)
    agent.learn(other, HERE, 3, 10.0, THERE, 6, True)
    assert np.array_equal(one["weights"], other["weights"])


def test_schedules_advance_with_the_episodes():
    agent = SarsaLambda(
        step_size=0.8,
        exploration=0.2,
        step_size_schedule=Linear(final=0.4, episodes=4),
        exploration_schedule=Exponential(rate=0.5),
    )
    state, seen = agent.begin(LOW, HIGH, 7), []
    for _ in range(6):
        agent.begin_episode(state)
        seen.append((8 * state["step_size"][0], state["exploration"][0]))
    expected = [(0.8, 0.2), (0.7, 0.1), (0.6, 0.05), (0.5, 0.025), (0.4, 0.0125), (0.4, 0.00625)]
    assert np.allclose(seen, expected)


def test_without_schedules_nothing_changes():
    agent = SarsaLambda()
    state = begun(begin := agent)
    for _ in range(5):
        begin.begin_episode(state)
    assert state["step_size"][0] == 0.9 / 8
    assert state["exploration"][0] == 0.15


def test_divergence_is_an_error_that_names_a_way_out():
    agent = SarsaLambda()
    state = begun(agent)
    with pytest.raises(LearningDiverged, match=r"episode 1 .*lower agent\.step_size"):
        agent.learn(state, HERE, 3, float("inf"), THERE, 1, False)


def test_a_range_that_cannot_be_tiled_is_named_with_its_full_key():
    with pytest.raises(InvalidValue, match=r"tile_coding\.variables"):
        SarsaLambda().begin(LOW, LOW, 7)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("step_size", 0),
        ("step_size", -0.1),
        ("step_size", 1.1),
        ("step_size", "big"),
        ("trace_decay", 1.1),
        ("trace_decay", -0.1),
        ("discount", 2),
        ("exploration", -0.1),
        ("exploration", None),
        ("traces", "eternal"),
        ("tile_coding", None),
        ("step_size_schedule", "linear"),
        ("exploration_schedule", 0.5),
    ],
)
def test_bad_values_are_refused_by_name(key, value):
    with pytest.raises(InvalidValue) as error:
        SarsaLambda(**{key: value})
    assert error.value.key == key


def test_a_schedule_that_ends_out_of_range_is_refused():
    with pytest.raises(InvalidValue, match=r"exploration_schedule\.final=2"):
        SarsaLambda(exploration_schedule=Linear(final=2.0, episodes=3))


@pytest.mark.parametrize(
    ("schedule", "given", "key"),
    [
        (Linear, {"final": -1, "episodes": 3}, "final"),
        (Linear, {"final": 0, "episodes": 0}, "episodes"),
        (Exponential, {"rate": 1.5}, "rate"),
        (Exponential, {"rate": 0.5, "final": -1}, "final"),
    ],
)
def test_bad_schedules_are_refused_by_name(schedule, given, key):
    with pytest.raises(InvalidValue) as error:
        schedule(**given)
    assert error.value.key == key
