"""Which classes a configuration may name."""

from __future__ import annotations

import sys

import pytest

from fieldrl.core.checks import InvalidValue
from fieldrl.runs import components, configuration, trust


@pytest.fixture
def theirs(tmp_path, monkeypatch) -> str:
    """A module of somebody else, on the path and not imported."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "theirs.py").write_text("class Agent:\n    pass\n")
    monkeypatch.delenv(trust.VARIABLE, raising=False)
    yield "theirs.Agent"
    sys.modules.pop("theirs", None)


def test_a_class_of_another_package_is_refused_by_name_and_not_imported(theirs):
    with pytest.raises(InvalidValue, match=r"agent\._target_=theirs\.Agent: .*FIELDRL_PACKAGES=theirs"):
        components.build({"_target_": theirs}, "agent")
    assert "theirs" not in sys.modules


@pytest.mark.parametrize("listed", ["theirs", "another, theirs", ",theirs,"])
def test_a_class_of_a_package_that_the_environment_lists_is_built(theirs, monkeypatch, listed):
    monkeypatch.setenv(trust.VARIABLE, listed)
    assert type(components.build({"_target_": theirs}, "agent")).__name__ == "Agent"


@pytest.mark.parametrize("listed", ["", "their", "theirs.module", "thei*"])
def test_only_the_whole_name_of_a_package_counts(theirs, monkeypatch, listed):
    monkeypatch.setenv(trust.VARIABLE, listed)
    with pytest.raises(InvalidValue, match="outside the packages"):
        components.build({"_target_": theirs}, "agent")


def test_a_whole_configuration_is_checked_before_any_of_it_is_imported(theirs):
    config = {
        "pde": {"domain": {"obstacles": [{"_target_": "fieldrl.core.domain.Circle"}, {"_target_": theirs}]}}
    }
    with pytest.raises(InvalidValue, match=r"pde\.domain\.obstacles\.1\._target_=theirs\.Agent"):
        trust.check_targets(config)
    assert "theirs" not in sys.modules


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("fieldrl.runs.atomic.remove", "must be a class"),
        ("fieldrl.runs.atomic.shutil.rmtree", "cannot be imported"),
        ("fieldrl.runs.atomic.Path", "outside the packages"),
        ("fieldrl.tracking.mlflow.queue.SimpleQueue", "cannot be imported"),
        ("os.system", "outside the packages"),
        ("fieldrl", "cannot be imported"),
        ("fieldrl_evil.Agent", "outside the packages"),
    ],
)
def test_nothing_but_classes_of_ours_is_called(target, words):
    with pytest.raises(InvalidValue, match=words):
        components.build({"_target_": target, "path": "/nowhere"}, "agent")


def test_a_configuration_cannot_allow_itself():
    for key in ("packages", trust.VARIABLE):
        with pytest.raises(InvalidValue, match="unknown key"):
            configuration.check({key: ["os"]})
