"""Training on the reduced double gyre, small, from the command line."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from tests.integration.conftest import summary

SMALL = (
    "experiment=double_gyre", "pde=reduced_double_gyre", "estimator=least_squares", "pde.cells=[24,12]",
    "pde.initial.scale=40", "pde.lower=[0.1,0.3]", "pde.upper=[0.4,0.9]", "pde.nodes=[7,9]", "pde.share=2",
    "pde.held_out=4", "pde.final_time=4", "steps=4", "tracking=none",
)  # fmt: skip


def test_a_run_builds_its_model_once_tells_so_and_finds_the_truth(run_here, tmp_path):
    status, _, errors = run_here(*SMALL)
    assert status == 0
    assert errors.count("reduced model") == 2
    assert "solves, about" in errors
    assert "% of the noise" in errors
    true, found = np.array([0.25, np.pi / 5]), summary(tmp_path)["pooled"]["parameters"]
    estimate = np.array([found[name]["estimate"] for name in ("mu", "omega")])
    assert np.all(np.abs(estimate - true) < [0.05, 0.1])
    (kept,) = {path.parent for path in tmp_path.rglob("*.solution")}
    assert kept == tmp_path / "outputs" / "reduced_models"

    status, _, errors = run_here(*SMALL, "seed=1")
    assert (status, errors) == (0, "")


def test_drawn_truths_of_the_reduced_model_are_the_same_for_any_number_of_workers(run_here, tmp_path):
    drawn = (*SMALL, "scenario=drawn", "pde.reduced_truth=true", "pde.truth_refinement=1", "replicates=2")
    for folder, workers in (("one", 1), ("two", 2)):
        parallel = "parallel=serial" if workers == 1 else "parallel=loky"
        jobs = () if workers == 1 else ("parallel.jobs=2",)
        status, _, _ = run_here(*drawn, f"output_dir={tmp_path / folder}", parallel, *jobs)
        assert status == 0
    one, two = (
        xr.load_dataset(next((tmp_path / folder / "runs").glob("*/record.nc"))) for folder in ("one", "two")
    )
    xr.testing.assert_identical(one.drop_attrs(), two.drop_attrs())
    assert len(np.unique(one["truth"])) == one["truth"].size


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("pde.share=0.00001", "pde.nodes=[7, 9]: the reduced model errs by"),
        ("pde.nodes=[7]", "pde.nodes=[7]: must be 2 numbers, one for each of mu, omega"),
        ("vehicle.time_step=0.5", "pde.interval=1.0: a reduced model predicts"),
        ("vehicle.sensor.noise=0", "pde.noise=0: must be > 0"),
    ],
)
def test_what_it_cannot_do_is_refused_in_a_line(run_here, override, said):
    status, _, errors = run_here(*SMALL, override)
    assert status == 1
    assert said in errors
    assert "Traceback" not in errors
