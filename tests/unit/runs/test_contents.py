"""A run's key depends on the contents of what its configuration names: code of other packages, files."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from fieldrl.runs import contents
from fieldrl.runs.identity import identity

FLOW = "class Flow:\n    speed = 1.0\n"


@pytest.fixture
def theirs(tmp_path, monkeypatch):
    """A package of somebody else, on the path and not imported."""
    monkeypatch.syspath_prepend(tmp_path)
    package = tmp_path / "their_flows"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "jet.py").write_text(FLOW)
    return package


def key_now(config):
    contents.package.cache_clear()  # a process keeps what it first saw, as it keeps what it imported
    return identity(config)


@pytest.mark.parametrize("file", ["jet.py", "__init__.py", "inner/helper.py"])
def test_another_code_of_a_class_that_is_not_ours_is_another_run(theirs, file):
    config = {"pde": {"flow": {"_target_": "their_flows.jet.Flow"}}, "seed": 0}
    before = key_now(config)
    assert key_now(config) == before
    (theirs / file).parent.mkdir(exist_ok=True)
    (theirs / file).write_text(FLOW.replace("1.0", "2.0"))
    assert key_now(config) != before
    assert "their_flows" not in sys.modules


def test_a_module_counts_as_apackage_does(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    config = {"agent": {"parts": [{"_target_": "their_module.Flow"}]}}
    absent = key_now(config)
    (tmp_path / "their_module.py").write_text(FLOW)
    before = key_now(config)
    (tmp_path / "their_module.py").write_text(FLOW + "# no difference but in the text\n")
    assert len({absent, before, key_now(config)}) == 3


def test_code_behind_a_key_that_cannot_change_a_result_does_not_count(theirs):
    config = {"tracking": {"_target_": "their_flows.jet.Flow"}}
    assert key_now(config) == key_now({})


@pytest.mark.parametrize("key", ["path", "mask_path"])
def test_the_contents_of_a_file_count_and_not_where_it_lies(tmp_path, key):
    first, moved = tmp_path / "currents.npz", tmp_path / "moved.npz"
    np.savez(first, u=np.zeros(3))
    moved.write_bytes(first.read_bytes())
    config = [
        {"pde": {"flows": [{"_target_": "fieldrl.pde.flow.GriddedFlow", key: str(path)}]}}
        for path in (first, moved)
    ]
    assert identity(config[0]) == identity(config[1])
    before = identity(config[0])
    np.savez(first, u=np.ones(3))
    assert identity(config[0]) != before


def test_a_path_without_a_file_counts_by_its_name():
    assert identity({"pde": {"path": "a"}}) != identity({"pde": {"path": "b"}})
