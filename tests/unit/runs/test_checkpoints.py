"""Checkpoints: exact, newest whole one first, never in the way of a run."""

from __future__ import annotations

import errno
import os
import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from fieldrl.core.checks import FieldrlError
from fieldrl.core.streams import stream
from fieldrl.runs import checkpoints as module
from fieldrl.runs.checkpoints import Checkpoints, Keeper


@dataclass
class Stub:
    """A replicate whose state is a number and its stream."""

    episodes: int
    finished: bool = False

    def state(self) -> dict[str, Any]:
        return {
            "agent": {"weights": np.arange(3.0) / 7, "count": np.array([2**62])},
            "nested": {"deep": {"empty": np.empty((0, 2)), "text": "x"}},
            "chance": stream(0, "x").bit_generator.state,
            "episodes": self.episodes,
        }


@pytest.fixture
def kept(tmp_path) -> Checkpoints:
    return Checkpoints(tmp_path / "checkpoints", "0123456789")


def test_a_state_comes_back_bit_for_bit(kept):
    kept.write(0, Stub(4), 1.5)
    found, expected = kept.read(0), Stub(4).state()
    assert (found.episodes, found.seconds) == (4, 1.5)
    for name in ("weights", "count"):
        assert found.state["agent"][name].dtype == expected["agent"][name].dtype
        np.testing.assert_array_equal(found.state["agent"][name], expected["agent"][name])
    assert found.state["nested"]["deep"]["empty"].shape == (0, 2)
    assert found.state["nested"]["deep"]["text"] == "x"
    assert found.state["chance"] == expected["chance"]


def test_replicates_have_checkpoints_of_their_own(kept):
    kept.write(0, Stub(4), 0.0)
    kept.write(1, Stub(7), 0.0)
    assert {number: one.episodes for number, one in kept.survey(3).items()} == {0: 4, 1: 7}


@pytest.mark.parametrize(
    "damage",
    [
        lambda b: b[:-1],
        lambda b: b[:40],
        lambda b: b"",
        lambda b: b[:-9] + b"X" + b[-8:],
        lambda b: b"{}\n" + b,
    ],
    ids=["truncated", "only a head", "empty", "one byte", "another head"],
)
def test_a_damaged_checkpoint_costs_no_more_than_the_time_since_the_one_before(kept, damage):
    for episodes in (3, 6):
        kept.write(0, Stub(episodes), 0.0)
    path = kept.folder / "replicate-0"
    path.write_bytes(damage(path.read_bytes()))
    with pytest.warns(UserWarning, match="replicate-0: is damaged"):
        found = kept.survey(1)
    assert found[0].episodes == 3
    assert not path.exists()


@pytest.mark.parametrize("change", [{"key": "another"}])
def test_a_checkpoint_of_another_run_is_not_taken(kept, change):
    kept.write(0, Stub(3), 0.0)
    assert replace(kept, **change).read(0) is None


@pytest.mark.parametrize("name", ["RESULTS", "__version__", "_LAYOUT"])
def test_a_checkpoint_of_another_version_is_not_taken(kept, monkeypatch, name):
    kept.write(0, Stub(3), 0.0)
    monkeypatch.setattr(module, name, "other")
    assert kept.read(0) is None


def test_a_write_that_fails_leaves_what_was_there(kept, monkeypatch):
    kept.write(0, Stub(3), 0.0)
    monkeypatch.setattr(os, "fsync", _full)
    with pytest.raises(FieldrlError, match="No space left"):
        kept.write(0, Stub(6), 0.0)
    assert kept.read(0).episodes == 3
    assert [path.name for path in kept.folder.iterdir()] == ["replicate-0"]


def _full(*_: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_is_a_line_and_no_reason_to_stop(kept, monkeypatch):
    monkeypatch.setattr(os, "fsync", _full)
    keep = Keeper(replace(kept, period=0.0), 0, 0.0)
    with pytest.warns(UserWarning, match=r"no checkpoint could be written \(No space left on device\)"):
        keep(Stub(1))


def test_checkpoints_are_written_after_their_period_and_at_the_end(kept):
    keep = Keeper(replace(kept, period=1e6), 0, 0.0)
    keep(Stub(1))
    assert kept.read(0) is None
    keep(Stub(2, finished=True))
    assert kept.read(0).episodes == 2


def test_checkpoints_take_no_more_than_their_share_of_the_time(kept, monkeypatch):
    clock = iter([0.0, 0.0, 3.0, 10.0, 149.0, 151.0, 152.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    keep = Keeper(replace(kept, period=0.0), 0, 0.0)
    keep(Stub(1))  # takes 3 s of the clock, so that the next is due at 153
    keep(Stub(2))
    keep(Stub(3))
    assert kept.read(0).episodes == 1


def test_nothing_is_left_when_they_are_removed(kept):
    kept.write(0, Stub(1), 0.0)
    kept.remove()
    kept.remove()
    assert not kept.folder.exists()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert kept.survey(2) == {}
