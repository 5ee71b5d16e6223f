"""What a sweep says while it goes."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fieldrl.cli import sweep_terminal
from fieldrl.cli.sweep_terminal import SweepTerminal, duration
from fieldrl.sweeps.objective import Objective
from fieldrl.sweeps.sweep_job import SweepJob


@pytest.mark.parametrize(
    ("seconds", "text"), [(4.4, "4 s"), (89, "89 s"), (100, "2 min"), (3000, "50 min"), (9000, "2.5 h")]
)
def test_durations_read_as_people_say_them(seconds, text):
    assert duration(seconds) == text


def test_each_job_tells_the_best_so_far_and_the_time_that_is_left(monkeypatch, capsys):
    clock = iter([0.0, 60.0, 120.0])
    monkeypatch.setattr(sweep_terminal, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    shown, objective = SweepTerminal(), Objective("late_e_total", "minimise")
    one, two = (SweepJob(n, (), {"seed": str(n)}, summary={"seconds": 60.0}, value=2.0 - n) for n in (0, 1))

    shown.job(one, 1, 3, objective, one)
    shown.job(two, 2, 3, objective, two)

    first, second = capsys.readouterr().out.splitlines()
    assert "late_e_total 2.000" in first
    assert "best 2.000  2 min left" in first
    assert "best 1.000  60 s left" in second
    assert max(map(len, (first, second))) <= 80
