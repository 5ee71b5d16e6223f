"""A sweep is its overrides."""

from __future__ import annotations

from pathlib import Path

from fieldrl.sweeps.sweep import Sweep, identity

ARGUMENTS = ("experiment=advection", "seed=0,1", "agent.step_size=0.1,0.5")


def test_the_order_of_the_overrides_does_not_matter():
    assert identity(ARGUMENTS, {}) == identity(ARGUMENTS[::-1], {})


def test_what_cannot_change_a_result_does_not_matter():
    beside = ("parallel.jobs=2", "output_dir=elsewhere", "force=true", "tracking=none")
    assert identity((*ARGUMENTS, *beside), {}) == identity(ARGUMENTS, {})


def test_values_and_the_method_matter():
    keys = [
        identity(ARGUMENTS, {}),
        identity((*ARGUMENTS[:2], "agent.step_size=0.1,0.6"), {}),
        identity(ARGUMENTS, {"seed": 1}),
    ]
    assert len(set(keys)) == 3


def test_the_folder_carries_the_experiment_and_the_key():
    sweep = Sweep("advection", "0123456789", Path("/somewhere"))
    assert sweep.folder == Path("/somewhere/sweeps/advection-sweep-0123456789")
