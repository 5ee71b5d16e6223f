"""A configuration that was taken from somebody else loads nothing of theirs."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.integration.conftest import SMALLEST, fieldrl, summary

CODE = "from pathlib import Path\nPath('loaded').touch()\nfrom fieldrl.agent.random import Random as Agent\n"
OWN = CODE + "class Mine(Agent):\n    pass\n"
TAKEN = {
    "an agent": "agent:\n  _target_: theirs.Mine",
    "an obstacle": "pde:\n  domain:\n    obstacles:\n      - _target_: theirs.Mine",
    "a callback of Hydra's": "hydra:\n  callbacks:\n    theirs:\n      _target_: theirs.Mine",
    "a handler of the log": "hydra:\n  job_logging:\n    handlers:\n      theirs:\n        (): theirs.Mine",
}


@pytest.fixture
def taken(tmp_path):
    """Write an experiment into a folder of its own, with the code that it wants to be loaded."""
    (tmp_path / "theirs.py").write_text(OWN)

    def write(text: str) -> tuple[str, ...]:
        place = tmp_path / "conf" / "experiment"
        place.mkdir(parents=True)
        (place / "taken.yaml").write_text(f"# @package _global_\n{text}\n")
        return f"--config-dir={tmp_path / 'conf'}", "experiment=taken", *SMALLEST, "parallel=serial"

    return write


@pytest.mark.parametrize("multirun", [(), ("-m", "seed=0,1")], ids=["run", "sweep"])
@pytest.mark.parametrize("text", TAKEN.values(), ids=TAKEN.keys())
def test_nothing_of_it_is_loaded_and_nothing_is_left(tmp_path, taken, text, multirun):
    arguments = taken(text)
    finished = fieldrl(tmp_path, *arguments, *multirun, PYTHONPATH=str(tmp_path))
    assert finished.returncode == 1
    assert "=theirs.Mine: is not imported" in finished.stderr
    assert "FIELDRL_PACKAGES=theirs" in finished.stderr
    assert len(finished.stderr.strip().splitlines()) <= 3
    assert {path.name for path in tmp_path.iterdir()} == {"conf", "theirs.py"}


def test_it_may_be_looked_at_without_being_loaded(tmp_path, taken):
    finished = fieldrl(tmp_path, *taken(TAKEN["an agent"]), "--cfg=job", PYTHONPATH=str(tmp_path))
    assert "theirs.Mine" in finished.stdout
    assert not Path(tmp_path / "loaded").exists()


def test_what_the_user_allows_is_run(tmp_path, taken):
    allowed = {"PYTHONPATH": str(tmp_path), "FIELDRL_PACKAGES": "theirs"}
    arguments = taken("defaults:\n  - override /agent: random\nagent:\n  _target_: theirs.Mine")
    finished = fieldrl(tmp_path, *arguments, **allowed)
    assert finished.returncode == 0, finished.stderr
    assert summary(tmp_path)["finished"]
    assert (tmp_path / "loaded").exists()
