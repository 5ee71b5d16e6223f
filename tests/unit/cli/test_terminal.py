"""What the terminal shows of a result."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from fieldrl.cli import terminal
from fieldrl.runs.folder import Run


def row(estimate: float) -> dict:
    return {
        "parameters": {"b_x": {"true": 5.0, "estimate": estimate, "unit": "length/time"}},
        "best_episode": 3, "episodes": 9, "steps": 20, "replicates": 1,
        "e_f": 0.9, "e_cv": 1.1, "e_total": 2.0, "theta_error": abs(estimate - 5.0), "field_rmse": 0.1,
        "forward_solves": 100,
        "pooled": {"parameters": {"b_x": {"estimate": 5.001}}},
    }  # fmt: skip


def summary(*estimates: float) -> dict:
    rows = [row(estimate) for estimate in estimates]
    return rows[0] | {
        "replicates_table": rows, "noise": 1.0, "late_e_total": [2.1] * len(rows), "seconds": 3.21,
        "greedy": [{"e_total": 1.9, "return": 50.0}] * len(rows),
    }  # fmt: skip


def shown(found: dict) -> str:
    screen = Console(file=io.StringIO(), width=80)
    screen.print(terminal.table(found))
    return screen.file.getvalue()  # type: ignore[attr-defined]


def test_one_replicate_is_shown_without_a_spread():
    text = shown(summary(5.1))
    assert "b_x [length/time]" in text
    assert "5.100" in text
    assert "median" not in text


def test_several_replicates_are_shown_with_median_and_quartiles():
    assert "5.100 [5.050, 5.150]" in shown(summary(5.1, 5.0, 5.2))


def test_total_error_stands_beside_its_expectation():
    line = next(line for line in shown(summary(5.1)).splitlines() if "greedy" in line)
    assert line.split()[-2:] == ["2.000", "1.900"]


def test_all_samples_stand_first_with_their_interval_and_the_best_episode_after_them():
    found = summary(5.1)
    found["pooled"]["parameters"]["b_x"]["interval"] = [4.981, 5.021]
    lines = [line.strip() for line in shown(found).splitlines()]
    pooled, best = lines.index("all 180 samples"), lines.index("best episode (number 4)")
    assert pooled < best
    assert lines[pooled + 1].split() == ["b_x", "[length/time]", "5.000", "5.001", "±", "0.020"]
    assert lines[best + 1].split()[-1] == "5.100"


def test_the_table_fits_80_columns():
    assert max(len(line) for line in shown(summary(5.1, 5.0, 5.2)).splitlines()) <= 80


def test_what_is_not_known_is_left_empty():
    found = summary(5.1)
    found["field_rmse"] = found["replicates_table"][0]["field_rmse"] = None
    assert "None" not in shown(found)


@pytest.mark.parametrize("problem", ["", "MLflow did not take this run: it is asleep"])
def test_a_problem_of_the_tracking_is_one_line(tmp_path, capsys, problem):
    terminal.Terminal().result(summary(5.1), Run("advection", "0123456789", tmp_path), problem)
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == problem if problem else lines[-1].startswith("files")


def test_the_ui_is_opened_by_make_only_on_the_outputs_of_a_checkout(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert terminal.ui_command(tmp_path / "outputs") == "python -m fieldrl.tracking.ui outputs"
    (tmp_path / "conf").mkdir()
    (tmp_path / "Makefile").touch()
    assert terminal.ui_command(tmp_path / "outputs") == "make ui"
    assert terminal.ui_command(Path("/elsewhere")).startswith("python")
