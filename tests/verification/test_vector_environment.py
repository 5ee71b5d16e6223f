"""Many missions at once are the same missions, bit for bit, in the layout of Gymnasium's SyncVectorEnv."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from fieldrl.core.checks import FieldrlError
from fieldrl.mission.vector import FieldSamplingVector

ADVECTION = "fieldrl/Advection-v0"
SHORT = ["steps=4"]
SEARCH = [
    "steps=5",
    "pde.true=[0,0]",
    "pde.lower=[-3,-3]",
    "pde.upper=[3,3]",
    "pde.initial.scale=20",
    "scenario=drawn",
    "scenario.place=[[90,60],[130,130]]",
    "vehicle.start=[80,80]",
    "vehicle.heading_limits=null",
    "vehicle.sensor.covariance=[4,4,.1]",
    "observation=informed",
    "reward=information_gain",
]
SOURCE = "{_target_: fieldrl.pde.source.LocalisedSource, strength: 5, centre: [80, 80], width: 10}"
AMPLITUDE = (
    "unknown={b_x: {true: 5, lower: -15, upper: 15}, b_y: {true: 5, lower: -15, upper: 15},"
    " amplitude: {true: 100, lower: 50, upper: 150}}"
)
BATCHES = {
    "as shipped": [],
    "information": [*SHORT, "reward=information_gain"],
    "informed": [*SHORT, "observation=informed"],
    "folds as needed": [*SHORT, "reward=information_gain", "cross_validation=as_needed"],
    "drawn, vague, without heading limits": SEARCH,
    "a source and no noise": [*SHORT, f"pde.source={SOURCE}", "vehicle.sensor.noise=0"],
    "three unknowns": [*SHORT, "estimator.grid=5", "observation=informed", AMPLITUDE],
    "another exponent, an obstacle": [
        *SHORT,
        "pde.initial.exponent=1.5",
        "pde.domain.obstacles=[{_target_: fieldrl.core.domain.Circle, centre: [50, 20], radius: 12}]",
    ],
}
LOOPS = {
    "another reward": [*SHORT, "reward=a_optimal"],
    "another reward, folds as needed": [*SHORT, "reward=a_optimal", "cross_validation=as_needed"],
    "a local optimiser": [*SHORT, "estimator.starts=1"],
    "ends early": ["steps=8", "stop={b_x: 1.0}"],
}


def vector(overrides: list[str], count: int = 3, **settings: Any) -> Any:
    return gymnasium.make_vec(ADVECTION, num_envs=count, overrides=overrides, **settings)


def one_by_one(overrides: list[str], count: int = 3, mode: str = "NextStep") -> Any:
    kwargs: Any = {"vectorization_mode": "sync", "vector_kwargs": {"autoreset_mode": mode}}
    return gymnasium.make_vec(ADVECTION, num_envs=count, overrides=overrides, **kwargs)


def assert_same(found: Any, expected: Any) -> None:
    """Equal to the bit, in types and shapes as well."""
    if isinstance(expected, dict):
        assert set(found) == set(expected)
        for name in expected:
            assert_same(found[name], expected[name])
    elif isinstance(expected, tuple) or (isinstance(expected, np.ndarray) and expected.dtype.kind == "O"):
        for one, other in zip(found, expected, strict=True):
            assert_same(one, other)
    elif expected is None:
        assert found is None
    else:
        assert (found.dtype, found.shape) == (expected.dtype, expected.shape)
        np.testing.assert_array_equal(found, expected)


def assert_same_missions(ours: Any, theirs: Any, steps: int, seed: int = 7) -> None:
    rng = np.random.default_rng(0)
    assert_same(ours.reset(seed=seed), theirs.reset(seed=seed))
    for _ in range(steps):
        actions = rng.integers(7, size=ours.num_envs)
        for found, expected in zip(ours.step(actions), theirs.step(actions), strict=True):
            assert_same(found, expected)


@pytest.mark.parametrize("overrides", BATCHES.values(), ids=BATCHES)
def test_a_batch_is_what_single_environments_are_bit_for_bit(overrides):
    ours = vector(overrides)
    assert ours.unwrapped.batch is not None
    assert_same_missions(ours, one_by_one(overrides), 24 if overrides == [] else 13)


@pytest.mark.parametrize("overrides", LOOPS.values(), ids=LOOPS)
def test_what_cannot_be_a_batch_is_a_loop_of_the_same_class(overrides):
    ours = vector(overrides)
    assert isinstance(ours, FieldSamplingVector)
    assert ours.unwrapped.batch is None
    assert_same_missions(ours, one_by_one(overrides), 10)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_missions_that_ended_begin_anew_as_the_autoreset_mode_says(mode):
    ours = vector(SHORT, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] == AutoresetMode(mode)
    assert_same_missions(ours, one_by_one(SHORT, mode=mode), 11)


def test_without_autoreset_a_mask_says_which_missions_begin_anew():
    ours = vector(SHORT, autoreset_mode="Disabled")
    theirs = one_by_one(SHORT, mode="Disabled")
    assert_same_missions(ours, theirs, 2)
    mask = np.array([True, False, True])
    reset = [each.reset(seed=[5, None, 6], options={"reset_mask": mask.copy()}) for each in (ours, theirs)]
    assert_same(*reset)
    for _ in range(2):
        for found, expected in zip(*(each.step(np.array([0, 3, 5])) for each in (ours, theirs)), strict=True):
            assert_same(found, expected)
    with pytest.raises(FieldrlError, match="reset"):
        ours.step(np.zeros(3, dtype=int))


def test_environment_i_has_seed_plus_i():
    ours, single = vector(SHORT), gymnasium.make(ADVECTION, overrides=SHORT)
    ours.reset(seed=20)
    single.reset(seed=22)
    for action in (0, 3, 5, 6):
        *_, infos = ours.step(np.full(3, action))
        assert infos["value"][2] == single.step(action)[4]["value"]


def test_the_environments_follow_when_they_are_looked_at():
    ours, theirs = vector(SHORT, render_mode="rgb_array"), one_by_one(SHORT)
    assert_same_missions(ours, theirs, 3)
    assert [len(each.samples) for each in ours.call("situation")] == [3, 3, 3]
    for name in ("state", "time", "estimate", "previous", "over", "own"):
        assert_same(
            np.array(ours.get_attr(name)), np.array([getattr(each.unwrapped, name) for each in theirs.envs])
        )
    pictures = ours.render()
    assert len(pictures) == 3
    assert not np.array_equal(pictures[0], pictures[1])


def test_a_changed_environment_is_stepped_as_it_is_now():
    ours, theirs = vector(SHORT), one_by_one(SHORT)
    assert_same_missions(ours, theirs, 2)
    for each in (ours, theirs):
        each.set_attr("steps", 3)
    for found, expected in zip(*(each.step(np.array([0, 1, 2])) for each in (ours, theirs)), strict=True):
        assert_same(found, expected)
    assert ours.step(np.array([0, 1, 2]))[2].tolist() == [False] * 3  # they ended after three, and begin anew


def test_bad_input_is_refused_by_name():
    ours = vector(SHORT)
    with pytest.raises(FieldrlError, match="reset"):
        ours.step(np.zeros(3, dtype=int))
    ours.reset(seed=0)
    with pytest.raises(FieldrlError, match="action=7"):
        ours.step(np.array([0, 7, 0]))
    with pytest.raises(FieldrlError, match="autoreset_mode=never"):
        vector(SHORT, autoreset_mode="never")
    with pytest.raises(FieldrlError, match="num_envs=0"):
        vector(SHORT, count=0)


def test_the_double_gyre_is_a_loop_that_shares_its_solves():
    small = ["steps=2", "pde.cells=[71,36]", "pde.order=5", "estimator.budget=6"]
    ours = gymnasium.make_vec("fieldrl/DoubleGyre-v0", num_envs=2, overrides=small)
    assert ours.unwrapped.batch is None
    observations, _ = ours.reset(seed=0)
    assert observations.shape == (2, 4)
    ends = [ours.step(np.array([0, 3]))[2].tolist() for _ in range(3)]
    assert ends == [[False, False], [True, True], [False, False]]
