"""The publishing process: an answer, whatever happens; and a run that does not wait for it."""

from __future__ import annotations

import io
import json
import os
import socket
import sys
from typing import Any

import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.tracking import publisher, ui
from fieldrl.tracking.mlflow import Mlflow
from fieldrl.tracking.none import Untracked

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")  # MLflow's own, as it is imported


class Refusing:
    """A publication that cannot publish run 1."""

    def __init__(self, **where: Any) -> None:
        self.done_: list[str] = []
        self.given_up: list[str] = []
        self.ended = ""

    def done(self, run: str) -> None:
        if run == "1":
            raise RuntimeError("the disk\nis   full")
        self.done_.append(run)

    def give_up(self, run: str) -> None:
        self.given_up.append(run)

    def end(self, status: str) -> None:
        self.ended = status


def served(monkeypatch, messages: list[tuple[str, dict]]) -> tuple[Refusing, list[dict]]:
    publication, answers = Refusing(), io.StringIO()
    monkeypatch.setattr(publisher, "_opened", lambda **where: publication)
    opening = ("open", {"process": os.getppid(), "where": {}})
    publisher.serve(iter([opening, *messages]), answers)
    return publication, [json.loads(line) for line in answers.getvalue().splitlines()]


def test_a_run_that_is_refused_is_told_and_does_not_keep_the_others_from_being_published(monkeypatch):
    publication, answers = served(monkeypatch, [("done", {"run": run}) for run in "012"])
    assert (publication.done_, publication.given_up) == (["0", "2"], ["1"])
    assert [answer["problem"] for answer in answers] == ["", "", "the disk is full", "the disk is full"]
    assert publication.ended == "KILLED"  # what has not been finished when the messages end


def test_nothing_is_published_of_a_run_that_was_killed_in_the_meantime(monkeypatch):
    monkeypatch.setattr(publisher, "_opened", lambda **where: pytest.fail("opened"))
    answers = io.StringIO()
    publisher.serve(iter([("open", {"process": -1, "where": {}})]), answers)
    assert answers.getvalue() == ""


def test_a_publisher_that_cannot_start_is_a_problem_of_one_line_not_of_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    pipe = Mlflow().publisher(tmp_path, "advection")
    pipe.send("begin", run={})
    problem = pipe.finish()
    assert "MLflow did not take this run: its process ended without an answer" in problem
    assert "\n" not in problem


def test_a_publisher_that_does_not_answer_is_left_after_the_patience(tmp_path, monkeypatch):
    script = tmp_path / "sleep"
    script.write_text("#!/bin/sh\nexec sleep 60\n")
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(script))
    pipe = Mlflow(patience=0.2).publisher(tmp_path, "advection")
    pipe.start()
    assert "no answer within 0.2 s" in pipe.finish()


def test_a_sweep_of_which_nothing_is_news_starts_no_process(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/not/there")
    pipe = Mlflow().publisher(tmp_path, "advection", {"name": "x", "key": "x", "arguments": []})
    assert pipe.finish() == ""
    pipe.abandon()


def test_no_tracking_wants_nothing_and_has_no_problem(tmp_path):
    assert not Untracked().wanted(tmp_path)
    assert Untracked().publisher(tmp_path, "advection").finish() == ""


def test_a_run_is_wanted_by_each_sweep_and_once_on_its_own(tmp_path):
    assert Mlflow().wanted(tmp_path)
    (tmp_path / "tracking.json").write_text(json.dumps({"run_id": "7", "sweeps": ["a"]}))
    assert not Mlflow().wanted(tmp_path)
    assert [Mlflow().wanted(tmp_path, sweep) for sweep in "ab"] == [False, True]


@pytest.mark.parametrize("wrong", [{"uri": "here"}, {"patience": 0}, {"patience": "long"}])
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(InvalidValue):
        Mlflow(**wrong)


def test_the_ui_takes_the_next_free_port_and_the_loopback_address_only(tmp_path):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert ui.free_port(port) > port
    command = ui.command(tmp_path / "mlflow.db", 5000)
    assert command[command.index("--host") + 1] == "127.0.0.1"
    assert f"sqlite:///{tmp_path / 'mlflow.db'}" in command
