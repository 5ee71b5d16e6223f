"""The examples run, at a small size, and leave their pictures."""

from __future__ import annotations

import importlib.util
import subprocess
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


def test_every_example_is_tested_and_explained():
    told = (EXAMPLES.parent / "docs" / "examples.md").read_text()
    tested = Path(__file__).read_text()
    for path in EXAMPLES.glob("*.py"):
        assert f'"{path.stem}"' in tested
        assert f"examples/{path.name}" in told


def test_the_file_of_samples_is_what_its_maker_makes(example):
    made = example("make_samples")
    assert made.FILE.read_text() == made.text()


def test_my_samples(example, tmp_path, capsys):
    example("my_samples").main(tmp_path)
    assert drawn(tmp_path) == ["my_samples", "my_samples_next"]
    assert "b_x = 4.1791 [4.1498, 4.2082]" in capsys.readouterr().out


def test_the_notebook_runs_and_is_kept_without_outputs():
    code = (
        "import nbclient, nbformat\n"
        "book = nbformat.read('my_samples.ipynb', 4)\n"
        "cells = [cell for cell in book.cells if cell.cell_type == 'code']\n"
        "assert not any(cell.outputs or cell.execution_count for cell in cells)\n"
        "nbclient.NotebookClient(book, timeout=300, resources={'metadata': {'path': '.'}}).execute()\n"
        "assert sum('image/png' in str(cell.outputs) for cell in cells) == 3\n"
        "print(''.join(output.get('text', '') for output in cells[-1].outputs))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=EXAMPLES, capture_output=True, text=True, timeout=500
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Far off, and of little weight: sample 13." in done.stdout


def test_my_flow(example, tmp_path, capsys):
    example("my_flow").main(tmp_path, cells=(48, 24))
    assert drawn(tmp_path) == ["my_flow"]
    assert "Told by the samples: speed" in capsys.readouterr().out


def test_my_model_with_every_estimator(example, tmp_path, capsys):
    example("my_model").main(tmp_path, samples=6, budget=6)
    assert drawn(tmp_path) == ["my_model"]
    told = capsys.readouterr().out
    assert all(name in told for name in ("LeastSquares", "GaussianProcess", "Composite"))


def test_slow_model(example, tmp_path, capsys):
    example("slow_model").main(tmp_path, delay=0.0)
    assert drawn(tmp_path) == ["slow_model"]
    assert "2 threads: " in capsys.readouterr().out


def test_my_agent(example, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("FIELDRL_PACKAGES", "")  # given back at the end
    example("my_agent").main(tmp_path, *QUICK)
    assert drawn(tmp_path) == ["my_agent"]
    assert "spiral: all samples tell the flow" in capsys.readouterr().out


def test_a_sweep(example, tmp_path, capsys):
    example("sweep").main(tmp_path, *QUICK, "episodes=2", seeds=1)
    assert drawn(tmp_path) == ["sweep"]
    assert "lawnmower 0" in capsys.readouterr().out


@pytest.mark.filterwarnings("ignore")
def test_a_learner_of_another_library(example, tmp_path, capsys):
    pytest.importorskip("stable_baselines3")
    example("other_library").main(tmp_path, steps=30, episodes=2)
    assert drawn(tmp_path) == ["other_library"]
    assert "DQN: return" in capsys.readouterr().out
