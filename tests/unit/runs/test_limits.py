"""What does not fit is refused, what takes long is told, anything else passes in silence."""

from __future__ import annotations

import warnings

import pytest

from fieldrl.core.checks import FieldrlError
from fieldrl.core.cost import Cost
from fieldrl.runs import limits

CONFIG = {"replicates": 2, "episodes": 3, "steps": 4, "evaluation_episodes": 5, "pde": {"cells": [9, 9]}}
BY = ("replicates", "episodes", "steps", "evaluation_episodes")


def check(memory=0.0, seconds=0.0, processes=1):
    needs = {"water": Cost(memory, seconds, ("cells", "nothing")), "record": Cost(1.0, 1.0, BY)}
    limits.check(needs, CONFIG, processes)


def test_an_ordinary_run_passes_in_silence():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(1e6, 60.0)


def test_what_does_not_fit_is_refused_with_both_sizes_and_the_settings(monkeypatch):
    monkeypatch.setattr(limits, "available", lambda: 2e9)
    with pytest.raises(FieldrlError) as error:
        check(memory=5e9)
    text = str(error.value)
    assert "about 5.25 GB of memory, 2 GB are available" in text
    assert "pde.cells=[9, 9]" in text
    assert "episodes=3" in text
    assert len(text.splitlines()) <= 3
    assert "parallel.jobs" not in text


def test_fewer_processes_are_the_way_out_where_there_are_several(monkeypatch):
    monkeypatch.setattr(limits, "available", lambda: 2e9)
    with pytest.raises(FieldrlError, match=r"parallel\.jobs=1"):
        check(memory=5e9, processes=2)


def test_hours_are_announced_and_centuries_refused():
    with pytest.warns(limits.LongRun, match=r"estimated to take 10 h.*pde\.cells"):
        check(seconds=36000.0)
    with pytest.raises(FieldrlError, match="317 years"):
        check(seconds=1e10)


def test_available_memory_is_a_fraction_of_an_ordinary_machine():
    assert 1e7 < limits.available() < 1e14


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0 s"), (90.0, "1.5 min"), (7200.0, "2 h"), (2e5, "2.31 days")]
)
def test_times_are_told_in_the_unit_that_suits_them(seconds, text):
    assert limits.duration(seconds) == text


@pytest.mark.parametrize(("size", "text"), [(5e6, "5 MB"), (2.5e9, "2.5 GB"), (4e12, "4 TB")])
def test_sizes_are_told_in_the_unit_that_suits_them(size, text):
    assert limits._bytes(size) == text


def test_a_limit_of_the_process_counts(monkeypatch):
    import resource

    monkeypatch.setattr(resource, "getrlimit", lambda which: (1, 1))
    assert limits.available() == 0.0


def test_a_limit_of_the_control_group_counts(monkeypatch, tmp_path):
    (tmp_path / "memory.max").write_text("3000000\n")
    (tmp_path / "memory.current").write_text("1000000\n")
    monkeypatch.setattr(limits, "_CONTROL_GROUP", tmp_path)
    assert limits.available() == 2e6
    (tmp_path / "memory.max").write_text("max\n")
    assert limits.available() > 2e6
