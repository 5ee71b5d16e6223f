"""fieldrl list, show and clean."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from filelock import FileLock

from fieldrl.cli import list_show_clean, report
from fieldrl.core.checks import FieldrlError

SUMMARY = {
    "finished": True,
    "parameters": {"mu": {"true": 0.25, "estimate": 0.24, "unit": "1"}},
    "pooled": {"parameters": {"mu": {"estimate": 0.2497}}},
    **{"best_episode": 2, "episodes": 10, "steps": 10, "replicates": 1, "noise": 1.0, "seconds": 1.0},
    **{"e_f": 1.0, "e_cv": 1.0, "e_total": 2.0, "theta_error": 0.01, "field_rmse": 0.5},
    **{"late_e_total": [2.0], "greedy": []},
}


@pytest.fixture
def outputs(tmp_path: Path) -> Path:
    """A finished run and an unfinished one."""
    finished, unfinished = (tmp_path / "runs" / f"gyre-{key * 10}" for key in "ab")
    for folder in (finished, unfinished):
        (folder / ".hydra").mkdir(parents=True)
        (folder / ".hydra" / "overrides.yaml").write_text("- experiment=gyre\n- seed=3\n- agent=lawnmower\n")
    row = {**SUMMARY, "replicate": 0}
    summary = {**SUMMARY, "key": "a" * 10, "replicates_table": [row]}
    (finished / "summary.json").write_text(json.dumps(summary))
    return tmp_path


def test_list_tells_finished_from_unfinished_runs(outputs, capsys):
    list_show_clean.list_runs([f"output_dir={outputs}"])
    said = capsys.readouterr().out
    assert "gyre seed=3 lawnmower" in said
    assert "mu 0.2497" in said
    assert "unfinished" in said
    assert max(map(len, said.splitlines())) <= 80


def test_list_of_nothing_says_so(tmp_path, capsys):
    list_show_clean.list_runs([f"output_dir={tmp_path}"])
    assert "no runs in" in capsys.readouterr().out


def test_show_takes_the_beginning_of_a_key(outputs, capsys):
    list_show_clean.show([f"output_dir={outputs}", "aa"])
    said = capsys.readouterr().out
    assert "All 100 samples give mu = 0.2497." in said
    assert "fieldrl experiment=gyre seed=3 agent=lawnmower" in said


@pytest.mark.parametrize(
    ("words", "message"),
    [(["gyre"], "2 runs begin so"), (["c"], "no such run"), (["bb"], "is not finished"), ([], "which one")],
)
def test_show_says_why_it_cannot(outputs, words, message):
    with pytest.raises(FieldrlError, match=message):
        list_show_clean.show([f"output_dir={outputs}", *words])


def test_clean_removes_unfinished_runs_only(outputs):
    list_show_clean.clean([f"output_dir={outputs}", "--yes"])
    assert [path.name for path in (outputs / "runs").iterdir()] == ["gyre-aaaaaaaaaa"]


def test_clean_never_removes_a_run_that_is_held(outputs, capsys):
    (outputs / ".locks").mkdir(exist_ok=True)
    with FileLock(outputs / ".locks" / "gyre-bbbbbbbbbb.lock"):
        list_show_clean.clean([f"output_dir={outputs}", "--yes"])
    assert "it stays" in capsys.readouterr().out
    assert (outputs / "runs" / "gyre-bbbbbbbbbb").exists()


def test_clean_removes_nothing_where_nobody_can_agree(outputs, monkeypatch):
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    with pytest.raises(FieldrlError, match="--yes"):
        list_show_clean.clean([f"output_dir={outputs}"])
    assert (outputs / "runs" / "gyre-bbbbbbbbbb").exists()


def test_an_option_that_is_not_there_is_refused(outputs):
    with pytest.raises(FieldrlError, match="output_dir=FOLDER"):
        list_show_clean.clean(["--force"])


def test_report_of_several_runs_and_of_a_sweep(outputs, capsys):
    folder = outputs / "sweeps" / "gyre-sweep-0123456789"
    folder.mkdir(parents=True)
    (folder / "results.csv").write_text(
        "job,status,run\n0,finished,gyre-aaaaaaaaaa\n1,failed,gyre-bbbbbbbbbb\n"
    )

    report.main(["gyre-sweep", f"output_dir={outputs}"])

    assert "gyre seed=3 lawnmower" in (folder / "report.html").read_text()
    assert capsys.readouterr().out.strip().endswith("report.html")


@pytest.mark.parametrize(
    ("words", "message"),
    [([], "which?"), (["bb"], "is not finished"), (["aa"], "its record is damaged"), (["c"], "no such run")],
)
def test_report_says_why_it_cannot(outputs, words, message):
    with pytest.raises(FieldrlError, match=message):
        report.main([*words, f"output_dir={outputs}"])
