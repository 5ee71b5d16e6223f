"""Whole runs with a model or flow that is not ours, from the command line."""

from __future__ import annotations

import json
import sqlite3

import numpy as np
import pytest

from tests.integration.conftest import SMALLEST, fieldrl

MODEL = """
import numpy as np
from fieldrl.core.parameters import Parameters


class Eddy:
    names, units = ("spin",), ("rad/time",)

    def velocity(self, theta, x, y, t):
        return -0.1 * (y - 100.0), 0.1 * (x - 100.0)


class Decay:
    parameters = Parameters(
        ("amplitude", "rate"), ("field unit", "1/time"), (50.0, 0.0), (150.0, 0.5), (120.0, 0.2)
    )

    def __init__(self, flow=None):
        self.flow = flow

    def predict(self, theta, positions, times):
        shape = np.exp(-np.sum((positions - 30.0) ** 2, axis=1) / 30.0**2)
        return theta[:, :1] * np.exp(-theta[:, 1:] * times) * shape
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with a module and an option of one's own."""
    (tmp_path / "my_model.py").write_text(MODEL)
    option = tmp_path / "conf" / "pde" / "mine.yaml"
    option.parent.mkdir(parents=True)
    option.write_text("_target_: my_model.Decay\nflow:\n  _target_: my_model.Eddy\n")
    return tmp_path


def test_a_plain_model_runs_from_the_command_line_and_is_tracked_and_its_code_is_part_of_the_key(folder):
    allowed = {"PYTHONPATH": str(folder), "FIELDRL_PACKAGES": "my_model"}
    command = ("--config-dir", "conf", "experiment=advection", "pde=mine", *SMALLEST[:-1], "parallel=serial")
    finished = fieldrl(folder, *command, figures=True, **allowed)
    assert finished.returncode == 0, finished.stderr
    assert finished.stderr == ""
    (run,) = (folder / "outputs" / "runs").iterdir()
    summary = json.loads((run / "summary.json").read_text())
    assert set(summary["parameters"]) == {"amplitude", "rate"}
    assert {path.stem for path in (run / "figures").glob("*.png")} >= {"course", "path", "field_error"}
    with sqlite3.connect(folder / "outputs" / "mlflow.db") as database:
        keys = {key for (key,) in database.execute("select key from latest_metrics")}
    assert {"pooled/amplitude", "pooled/rate", "field_rmse"} <= keys
    (folder / "my_model.py").write_text(MODEL.replace("30.0**2", "40.0**2"))
    again = fieldrl(folder, *command, "tracking=none", **allowed)
    assert again.returncode == 0, again.stderr
    assert len(list((folder / "outputs" / "runs").iterdir())) == 2


def test_another_file_of_currents_is_another_run(folder, run_here):
    def write(u):
        axes = {"x": np.array([0.0, 200.0]), "y": np.array([0.0, 100.0])}
        np.savez(folder / "currents.npz", **axes, u=np.full((2, 2), u), v=np.zeros((2, 2)))

    small = (
        "pde.cells=[24,12]",
        "pde.order=3",
        "pde.initial.scale=60",
        "pde.truth_refinement=1",
        "pde.final_time=2",
    )
    command = ("pde/flow=gridded", f"pde.flow.path={folder / 'currents.npz'}", *SMALLEST, *small)
    for u in (3.0, 4.0, 3.0):
        write(u)
        status, _, errors = run_here(*command)
        assert status == 0, errors
    assert len(list((folder / "outputs" / "runs").iterdir())) == 2  # the third is the first
