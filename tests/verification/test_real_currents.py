"""Real ocean currents as a flow: Arctic-20km surface currents of MET Norway (NLOD, CC BY 4.0)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fieldrl.core.domain import Domain
from fieldrl.core.samples import Samples
from fieldrl.estimator.composite import Composite
from fieldrl.estimator.problem import FitProblem
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.flow import GriddedFlow
from fieldrl.pde.initial import InitialFeature
from fieldrl.uncertainty import assess, noise_of

_DATA = Path(os.environ.get("FIELDRL_DATA", Path(__file__).parents[2].parent / "shared" / "data"))
_FILE = _DATA / "currents" / "arctic20_surface_hourly_20170201.nc"
_HOURS, _METRES = 3600.0, 1000.0
WINDOW = {"X": slice(16, 34), "Y": slice(23, 41)}  # the largest square without land
pytestmark = pytest.mark.skipif(not _FILE.exists(), reason=f"needs {_FILE.name}; FIELDRL_DATA says where")


@pytest.fixture(scope="module")
def currents(tmp_path_factory):
    """The window in km and hours, as docs/flows.md wants it, and what it was made of."""
    with xr.open_dataset(_FILE, engine="netcdf4") as file:
        data = file.isel(depth=0, **WINDOW).load()
    hours = (data["time"] - data["time"][0]) / np.timedelta64(1, "h")
    x, y = (data[name] / _METRES - data[name][0] / _METRES for name in ("X", "Y"))
    u, v = (data[name].transpose("time", "X", "Y") * _HOURS / _METRES for name in ("u", "v"))
    arrays = {"x": x.values, "y": y.values, "t": hours.values, "u": u.values, "v": v.values}
    path = tmp_path_factory.mktemp("currents") / "window.npz"
    np.savez(path, **arrays)
    return path, arrays


def test_velocities_at_grid_points_are_those_of_the_file(currents):
    path, arrays = currents
    flow = GriddedFlow(path)
    places = np.stack(np.meshgrid(arrays["x"], arrays["y"], indexing="ij"), axis=-1)
    for hour in (0, 17, 120):
        found = flow.velocity([1.0], places, float(hour)).reshape(18, 18, 2)
        np.testing.assert_allclose(found[..., 0], arrays["u"][hour], atol=1e-12)
        np.testing.assert_allclose(found[..., 1], arrays["v"][hour], atol=1e-12)


def test_how_much_of_a_real_current_carries_a_patch_is_found_from_samples(currents):
    path, _ = currents
    model = AdvectionDiffusion(
        flow=GriddedFlow(path, "share"), true=[1.0], lower=[0.0], upper=[2.0], diffusivity=2.0,
        domain=Domain(upper=(340.0, 340.0)), cells=(24, 24), order=3, final_time=60.0, interval=30.0,
        initial=InitialFeature(100.0, (170.0, 170.0), 80.0), truth_refinement=1,
    )  # fmt: skip
    rng = np.random.default_rng(0)
    positions, times = rng.uniform(60, 280, (30, 2)), rng.choice([30.0, 60.0], 30)
    values = model.predict(np.array([[0.8]]), positions, times)[0] + rng.normal(0, 1, 30)
    samples = Samples.of(positions, times, values)
    problem = FitProblem(model, samples, leave_one_out=False)
    fit = Composite().fit(problem)
    solved = np.vstack([fit.theta[:1], fit.known])
    found = assess(problem, fit.theta[0], noise_of(samples, 1.0), solved, solves=3)
    assert abs(fit.theta[0, 0] - 0.8) < 3 * found.std[0] < 0.5
    mass = model.solve([0.8]).sum(axis=(1, 2))
    assert mass[-1] == pytest.approx(mass[0], rel=0.05)  # what leaves through the walls
