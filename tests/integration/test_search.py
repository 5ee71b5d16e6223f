"""``hydra/sweeper=gp``: whole searches, small."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

TINY = ("experiment=advection", "episodes=1", "steps=2", "evaluation_episodes=0", "tracking=none")
SEARCH = (
    "-m", *TINY, "replicates=1", "hydra/sweeper=gp", "agent.step_size=tag(log,interval(0.01,1))",
    "agent.traces=replacing,dutch", "hydra.sweeper.n_initial=2", "hydra.sweeper.batch=2",
)  # fmt: skip


def state(folder: Path) -> dict:
    (path,) = (folder / "outputs" / "sweeps").glob("*/trials.json")
    return json.loads(path.read_text())


def values(folder: Path) -> list[dict[str, str]]:
    return [trial["values"] for trial in state(folder)["trials"]]


def test_a_search_leaves_its_trials_and_its_pictures_and_names_the_best(run_here, tmp_path):
    status, output, errors = run_here(*SEARCH, "hydra.sweeper.n_trials=4")
    assert (status, errors) == (0, "")
    trials = state(tmp_path)["trials"]
    assert len(trials) == 4
    best = min(trials, key=lambda trial: trial["late_e_total"])
    assert f"best    outputs/runs/{best['run']}" in output
    (folder,) = (tmp_path / "outputs" / "sweeps").iterdir()
    names = {path.name for path in folder.rglob("*.png")}
    assert names == {"convergence.png", "dependence.png"}
    assert not list(folder.rglob("*.pkl"))
    assert [line.count("best") for line in output.splitlines()[1:5]] == [1, 1, 1, 1]


def test_a_search_that_is_asked_for_more_goes_where_a_longer_one_goes(run_here, tmp_path):
    run_here(*SEARCH, "hydra.sweeper.n_trials=2")
    status, output, _ = run_here(*SEARCH, "hydra.sweeper.n_trials=6")
    assert status == 0
    assert "2 finished before" in output
    continued = values(tmp_path)
    (tmp_path / "elsewhere").mkdir()
    run_here(*SEARCH, "hydra.sweeper.n_trials=6", "output_dir=elsewhere")
    (path,) = (tmp_path / "elsewhere" / "sweeps").glob("*/trials.json")
    assert [trial["values"] for trial in json.loads(path.read_text())["trials"]] == continued


def test_a_garbled_state_costs_nothing(run_here, tmp_path):
    run_here(*SEARCH, "hydra.sweeper.n_trials=4")
    before = values(tmp_path)
    (path,) = (tmp_path / "outputs" / "sweeps").glob("*/trials.json")
    path.write_text(path.read_text()[:100])
    status, _, _ = run_here(*SEARCH, "hydra.sweeper.n_trials=4")
    assert status == 0
    assert values(tmp_path) == before
    assert len(list((tmp_path / "outputs" / "runs").iterdir())) == len({str(item) for item in before})


def test_a_failed_trial_does_not_end_the_search(run_here, tmp_path, monkeypatch):
    from fieldrl.runs import job

    compute = job._compute

    def breaks(work, *arguments, **options):
        if work.config["agent"]["traces"] == "dutch":
            raise MemoryError
        return compute(work, *arguments, **options)

    monkeypatch.setattr(job, "_compute", breaks)
    status, _, errors = run_here(*SEARCH, "hydra.sweeper.n_trials=6")
    assert status == 1
    trials = state(tmp_path)["trials"]
    failed = [trial for trial in trials if trial["values"]["agent.traces"] == "dutch"]
    assert 0 < len(failed) < len(trials) == 6
    assert all("not enough memory" in trial["reason"] for trial in failed)
    assert f"{len(failed)} of 6 jobs failed" in errors


BAD = {
    "no trial": (("hydra.sweeper.n_trials=0",), ["hydra.sweeper.n_trials=0", ">= 1"]),
    "a word for a number of trials": (("hydra.sweeper.n_trials=many",), ["hydra.sweeper.n_trials=many"]),
    "no design": (("hydra.sweeper.n_initial=0",), ["hydra.sweeper.n_initial=0", ">= 1"]),
    "an empty batch": (("hydra.sweeper.batch=0",), ["hydra.sweeper.batch=0", ">= 1"]),
    "a negative seed": (("hydra.sweeper.seed=-1",), ["hydra.sweeper.seed=-1", ">= 0"]),
    "an unknown objective": (("hydra.sweeper.objective=foo",), ["objective=foo", "late_e_total"]),
    "an unknown direction": (("hydra.sweeper.direction=up",), ["direction=up", "minimise, maximise"]),
    "an unknown setting": (("hydra.sweeper.trials=3",), ["hydra.sweeper.trials=3", "unknown key"]),
    "an interval that ends before it begins": (
        ("agent.discount=interval(1,0)",),
        ["agent.discount=interval(1,0)", "below its end"],
    ),
    "the logarithm of nothing": (
        ("agent.discount=tag(log,interval(0,1))",),
        ["agent.discount=interval(0,1)", "above 0"],
    ),
    "an interval of an unknown key": (
        ("agent.discuont=interval(0,1)",),
        ["agent.discuont=", "did you mean discount?"],
    ),
    "an interval outside of what is allowed": (
        ("agent.step_size=interval(2,3)", "hydra.sweeper.batch=1"),
        ["agent.step_size=", "(0, 1]"],
    ),
}


@pytest.mark.parametrize(("arguments", "wanted"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_refused_in_three_lines_and_leaves_nothing(run_here, tmp_path, arguments, wanted):
    status, output, errors = run_here(*SEARCH, *arguments)
    assert (status, output) == (1, "")
    assert 1 <= len(errors.strip().splitlines()) <= 3, errors
    assert all(word in errors for word in wanted), errors
    assert list(tmp_path.iterdir()) == []


def test_a_search_for_nothing_is_refused(run_here, tmp_path):
    status, _, errors = run_here("-m", *TINY, "hydra/sweeper=gp", "seed=1")
    assert status == 1
    assert "no key is searched" in errors
    assert list(tmp_path.iterdir()) == []
