"""The record of a run and its summary."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from fieldrl.core.domain import Circle, Domain, Rectangle
from fieldrl.mission import combine, run_replicate, summarise
from fieldrl.pde.advection import Advection

STEPS = ("replicate", "episode", "step")
DIMENSIONS = {
    "position": (*STEPS, "axis"),
    "measured_position": (*STEPS, "axis"),
    **dict.fromkeys(("heading", "time", "value", "action", "reward", "e_f", "e_cv", "e_total"), STEPS),
    "converged": STEPS,
    "theta": (*STEPS, "parameter"),
    "return": ("replicate", "episode"),
    "forward_solves": ("replicate", "episode"),
    "evaluation_position": ("replicate", "evaluation_episode", "step", "axis"),
    "evaluation_theta": ("replicate", "evaluation_episode", "step", "parameter"),
    "evaluation_return": ("replicate", "evaluation_episode"),
    "pooled": ("replicate", "parameter"),
    "pooled_residual": STEPS,
    "best_episode": ("replicate",),
    "field_true": ("x", "y"),
    "field_estimate": ("replicate", "x", "y"),
    "start": ("axis",),
    **dict.fromkeys(("true", "lower", "upper", "parameter_unit"), ("parameter",)),
}
OBSTACLES = [Rectangle((100.0, 100.0), (120.0, 130.0)), Circle((150.0, 50.0), 10.0)]


@pytest.fixture
def run(mission):
    return mission(water=Advection(domain=Domain(obstacles=OBSTACLES)), steps=5)


@pytest.fixture
def record(run) -> xr.Dataset:
    return combine([run_replicate(run, 0, number) for number in range(2)], run)


def test_every_documented_variable_is_there_with_its_dimensions(record):
    assert {name: record[name].dims for name in DIMENSIONS} == DIMENSIONS
    sizes = {"replicate": 2, "episode": 3, "evaluation_episode": 2, "step": 5, "axis": 2, "parameter": 2}
    assert {name: record.sizes[name] for name in sizes} == sizes


def test_every_variable_says_its_unit_and_what_it_is(record):
    silent = [name for name in [*record.data_vars, "x", "y"] if not record[name].attrs.get("units")]
    unnamed = [name for name in [*record.data_vars, "x", "y"] if not record[name].attrs.get("long_name")]
    assert (silent, unnamed) == ([], [])


def test_residuals_are_those_of_the_estimate_from_all_samples(run, record):
    for _, part in record.groupby("replicate"):
        part = part.squeeze("replicate")
        positions, times = part["measured_position"].values.reshape(-1, 2), part["time"].values.ravel()
        predicted = run.water.predict(part["pooled"].values[None], positions, times)[0]
        expected = (predicted - part["value"].values.ravel()).reshape(part["value"].shape)
        np.testing.assert_allclose(part["pooled_residual"].values, expected, atol=1e-9)


def test_the_share_of_fits_that_converged_is_kept_and_summed_up(record):
    assert record["converged"].values.min() > 0.99
    short = record.assign(converged=record["converged"] * 0 + np.array([1.0, 0.5])[:, None, None])
    assert [row["converged"] for row in summarise(short)["replicates_table"]] == [1.0, 0.5]


def test_nothing_is_missing_in_the_record(record):
    first = record.isel(solution=0)  # no others fit these samples
    holes = [name for name, values in first.data_vars.items() if values.isnull().any()]
    assert holes == []


def test_returns_are_sums_of_rewards(record):
    np.testing.assert_allclose(record["return"], record["reward"].sum("step"), rtol=1e-15)
    np.testing.assert_allclose(
        record["evaluation_return"], record["evaluation_reward"].sum("step"), rtol=1e-15
    )


def test_the_total_error_is_the_sum_of_its_parts(record):
    np.testing.assert_array_equal(record["e_total"], record["e_f"] + record["e_cv"])


def test_times_count_the_steps(record):
    np.testing.assert_array_equal(record["time"], np.broadcast_to(np.arange(1.0, 6.0), (2, 3, 5)))


def test_the_best_episode_has_the_least_total_error_at_its_end(record):
    last = record["e_total"].isel(step=-1)
    np.testing.assert_array_equal(record["best_episode"], last.argmin("episode"))


def test_the_field_estimate_is_the_best_episode_s(record, run):
    for replicate in range(2):
        best = int(record["best_episode"][replicate])
        theta = record["theta"].values[replicate, best, -1]
        expected = run.water.field(theta, 5.0, run.water.grid)
        np.testing.assert_array_equal(record["field_estimate"][replicate], expected)


def test_the_true_field_is_the_feature_where_the_flow_took_it(record):
    peak = record["field_true"].stack(at=("x", "y")).idxmax().item()
    np.testing.assert_allclose(peak, (75.0, 75.0), atol=1.01)


def test_values_are_the_true_field_at_the_true_position_with_noise_of_one(record, run):
    positions, times = record["position"].values.reshape(-1, 2), record["time"].values.ravel()
    clean = run.water.predict(np.array([[5.0, 5.0]]), positions, times)[0]
    noise = record["value"].values.ravel() - clean
    assert np.abs(noise).max() < 5.0
    assert noise.std() == pytest.approx(1.0, abs=0.5)


def test_attributes_hold_the_domain_and_its_obstacles(record):
    assert json.loads(record.attrs["obstacles"]) == [
        {"kind": "rectangle", "lower": [100.0, 100.0], "upper": [120.0, 130.0]},
        {"kind": "circle", "centre": [150.0, 50.0], "radius": 10.0},
    ]
    assert record.attrs["noise"] == 1.0
    assert record.attrs["domain_upper"] == [200.0, 200.0]


def test_the_record_survives_netcdf_with_its_attributes(record, tmp_path):
    path = tmp_path / "record.nc"
    record.to_netcdf(path, engine="netcdf4")
    with xr.open_dataset(path, engine="netcdf4") as kept:
        xr.testing.assert_equal(kept.load(), record)
        for name in [*record.data_vars, "x", "y"]:
            assert kept[name].attrs == record[name].attrs
        assert set(kept.attrs) == set(record.attrs)
        for name, value in record.attrs.items():
            np.testing.assert_array_equal(kept.attrs[name], value)


def test_the_summary_is_what_the_record_says(record):
    found = json.loads(json.dumps(summarise(record)))
    for replicate, row in enumerate([found, *found["replicates_table"]]):
        part = record.isel(replicate=max(replicate - 1, 0))
        best = int(np.argmin(part["e_total"].values[:, -1]))
        last = part.isel(episode=best, step=-1)
        theta = [row["parameters"][name]["estimate"] for name in ("b_x", "b_y")]
        assert row["best_episode"] == best
        assert theta == last["theta"].values.tolist()
        assert [row[name] for name in ("e_f", "e_cv", "e_total")] == [
            float(last[name]) for name in ("e_f", "e_cv", "e_total")
        ]
        assert row["theta_error"] == pytest.approx(np.hypot(theta[0] - 5.0, theta[1] - 5.0))
        difference = (part["field_estimate"] - part["field_true"]).values
        assert row["field_rmse"] == pytest.approx(np.sqrt(np.mean(difference**2)))
        assert row["forward_solves"] == int(part["evaluations"].sum())
        pooled = [row["pooled"]["parameters"][name]["estimate"] for name in ("b_x", "b_y")]
        assert pooled == part["pooled"].values.tolist()


def test_the_summary_says_what_was_asked(record):
    found = summarise(record)
    assert {name: found[name] for name in ("replicates", "episodes", "steps", "finished")} == {
        "replicates": 2, "episodes": 3, "steps": 5, "finished": True,
    }  # fmt: skip
    assert found["parameters"]["b_x"]["true"] == 5.0
    assert found["parameters"]["b_y"]["unit"] == "length/time"
    assert [row["replicate"] for row in found["replicates_table"]] == [0, 1]


def test_an_estimate_that_does_not_exist_is_null_in_the_summary(record):
    record["pooled"][:] = np.nan
    assert summarise(record)["pooled"]["parameters"]["b_x"]["estimate"] is None
