"""The examples run, at a small size, and leave their pictures."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
QUICK = ("tracking=none", "parallel=serial", "steps=4")


@pytest.fixture
def example(monkeypatch):
    """The module of an example by its name."""

    def load(name):
        monkeypatch.syspath_prepend(EXAMPLES)
        spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, name, module)
        spec.loader.exec_module(module)
        return module

    return load


def drawn(folder):
    """The pictures in a folder."""
    return sorted(path.stem for path in folder.glob("*.png"))


def test_the_file_of_samples_is_what_its_maker_makes(example):
    made = example("make_samples")
    assert made.FILE.read_text() == made.text()


def test_slow_model(example, tmp_path, capsys):
    example("slow_model").main(tmp_path, delay=0.0)
    assert drawn(tmp_path) == ["slow_model"]
    assert "2 threads: " in capsys.readouterr().out


def test_my_agent(example, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("FIELDRL_PACKAGES", "")  # given back at the end
    example("my_agent").main(tmp_path, *QUICK)
    assert drawn(tmp_path) == ["my_agent"]
    assert "spiral: all samples tell the flow" in capsys.readouterr().out
