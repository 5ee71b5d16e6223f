"""The publishing process: one answer, whatever happens."""

from __future__ import annotations

import socket
import sys

import pytest

from fieldrl.app import publisher, ui
from fieldrl.app.tracking import Mlflow, Untracked
from fieldrl.core.checks import InvalidValue


def test_a_failure_is_answered_in_one_line_after_every_message_was_read(monkeypatch):
    def fail(incoming):
        next(incoming)
        raise RuntimeError("the database\nis   locked")

    monkeypatch.setattr(publisher, "_publish", fail)
    incoming = iter([("begin", {}), ("replicate", {}), ("finish", {})])
    assert publisher.serve(incoming) == {"problem": "the database is locked", "run_id": ""}
    assert list(incoming) == []


def test_a_publisher_that_cannot_start_is_a_problem_of_one_line_not_of_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/false")
    publication = Mlflow().start(tmp_path)
    publication.begin(experiment="x", name="x", config={}, tags={}, replicates=1)
    problem = publication.finish(tmp_path, {}, {})
    assert "MLflow did not take this run" in problem
    assert "\n" not in problem


def test_a_publisher_that_does_not_answer_is_left_after_the_patience(tmp_path, monkeypatch):
    script = tmp_path / "sleep"
    script.write_text("#!/bin/sh\nsleep 60\n")
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(script))
    publication = Mlflow(patience=0.2).start(tmp_path)
    assert "no answer within 0.2 s" in publication.finish(tmp_path, {}, {})


def test_no_tracking_wants_nothing_and_has_no_problem(tmp_path):
    assert not Untracked().wanted(tmp_path)
    assert Untracked().start(tmp_path).finish(tmp_path, {}, {}) == ""


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
