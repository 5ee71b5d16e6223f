"""Folds that leave a sample out are fitted where somebody needs them, and change nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from fieldrl.mission import run_replicate
from fieldrl.reward.information_gain import InformationGain
from fieldrl.reward.shaped import Shaped
from fieldrl.reward.total_error import TotalError
from tests.unit.mission.conftest import small

OF_FOLDS = {"e_cv", "e_total", "evaluations", "forward_solves"}


class OfErrors:
    """A reward of somebody's own, which does not say what it needs."""

    def __call__(self, outcome):
        return -outcome.e_total


def recorded(cross_validation: str, **changed):
    return run_replicate(small(cross_validation=cross_validation, **changed), 0, 0)


@pytest.mark.parametrize("stop", [None, {"b_x": 8.0, "b_y": 8.0}], ids=["all samples", "until sure"])
def test_an_episode_s_last_errors_are_the_same_and_the_others_are_left_out(stop):
    changed = {"reward": InformationGain(), "stop": stop, "steps": 8}
    every, needed = recorded("every_step", **changed), recorded("as_needed", **changed)
    differing = {str(name) for name in every if not every[name].identical(needed[name])}
    assert {name.removeprefix("evaluation_") for name in differing} == OF_FOLDS
    last = int(np.isfinite(needed["time"][0]).sum()) - 1
    assert last == 7 if stop is None else last < 7
    for name in ("e_cv", "e_total"):
        assert np.isnan(needed[name][0, :last]).all()
        np.testing.assert_array_equal(needed[name][:, -1], every[name][:, -1])
    assert np.isfinite(needed["e_f"][0]).all()


@pytest.mark.parametrize("reward", [TotalError(), Shaped(TotalError()), OfErrors()])
def test_a_reward_of_errors_has_them_after_every_sample(reward):
    every, needed = recorded("every_step", reward=reward), recorded("as_needed", reward=reward)
    assert every.identical(needed)


def test_what_shapes_a_reward_needs_no_errors_of_its_own():
    needed = recorded("as_needed", reward=Shaped(InformationGain()))
    assert np.isnan(needed["e_total"][:, :-1]).all()
