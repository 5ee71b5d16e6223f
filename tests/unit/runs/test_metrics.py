"""Metrics of a record: names, series by episode, medians."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fieldrl.core.parameters import Parameters
from fieldrl.runs import metrics


@pytest.fixture
def record() -> xr.Dataset:
    """Two replicates, four episodes, three steps, one evaluation episode, one parameter."""
    rng = np.random.default_rng(0)
    variables: dict = {}
    for prefix, episodes in (("", 4), ("evaluation_", 1)):
        dims = ("replicate", f"{prefix}episode", "step")
        for name in ("e_f", "e_cv", "e_total", "converged"):
            variables[prefix + name] = (dims, rng.random((2, episodes, 3)))
        variables[f"{prefix}theta"] = ((*dims, "parameter"), rng.random((2, episodes, 3, 1)))
        variables[f"{prefix}return"] = (dims[:2], rng.random((2, episodes)))
    variables["forward_solves"] = (("replicate", "episode"), rng.integers(1, 9, (2, 4)))
    about = {"true": [0.5], "lower": [0.0], "upper": [1.0], "parameter_unit": ["1"]}
    return xr.Dataset(
        variables | {name: ("parameter", value) for name, value in about.items()}, {"parameter": ["mu"]}
    )


def test_a_series_holds_the_value_at_the_end_of_each_episode(record):
    learning, greedy = metrics.each(record)[1]
    np.testing.assert_array_equal(learning["e_total"], record["e_total"][1, :, -1])
    np.testing.assert_array_equal(learning["theta.mu"], record["theta"][1, :, -1, 0])
    np.testing.assert_allclose(learning["theta_error"], abs(record["theta"][1, :, -1, 0] - 0.5))
    assert greedy["evaluation/return"].shape == (1,)


def test_fits_that_did_not_converge_show_at_any_step_of_an_episode(record):
    learning, _ = metrics.each(record)[0]
    np.testing.assert_allclose(learning["converged"], record["converged"][0].mean("step"))


def test_a_parameter_that_nobody_knows_has_no_error(record):
    learning, _ = metrics.each(record.assign(true=("parameter", [np.nan])))[0]
    assert "theta_error" not in learning


def test_parameters_of_different_units_are_added_in_half_widths_of_their_bounds():
    units = Parameters(("mu", "omega"), ("1", "rad/time"), (0.0, 0.0), (1.0, 4.0), (0.5, 2.0))
    np.testing.assert_allclose(units.distance(np.array([[0.5, 3.0], [1.0, 2.0]])), [0.5, 1.0])
    alike = Parameters(("x", "y"), ("length",) * 2, (0.0, 0.0), (1.0, 4.0), (0.5, 2.0))
    np.testing.assert_allclose(alike.distance(np.array([0.8, 2.4])), 0.5)


def test_medians_are_taken_over_the_replicates(record):
    middle = metrics.middle(metrics.all_curves(record))
    np.testing.assert_allclose(middle["learning/return"], record["return"].mean("replicate"))


def test_curves_show_the_estimate_against_the_truth_and_what_was_spent_so_far(record):
    curves = metrics.all_curves(record)[0]
    np.testing.assert_allclose(curves["error/mu"], curves["estimate/mu"] - 0.5)
    np.testing.assert_array_equal(curves["learning/forward_solves"], record["forward_solves"][0].cumsum())
    assert curves["learning/mean_e_total"][-1] == pytest.approx(float(record["e_total"][0, :, -1].mean()))
    unknown = metrics.all_curves(record.assign(true=("parameter", [np.nan])))[0]
    assert "error/mu" not in unknown


def test_without_evaluation_episodes_there_is_nothing_greedy(record):
    empty = record.isel(evaluation_episode=slice(0, 0))
    assert metrics.greedy(metrics.each(empty)) == []


def test_the_late_total_error_is_the_mean_of_the_last_quarter(record):
    assert metrics.late(metrics.each(record)) == pytest.approx(record["e_total"][:, -1, -1].values)


def test_the_regret_of_the_fits_is_the_median_over_those_that_solved(record):
    loss = np.full((2, 4, 3, 2), np.nan)
    loss[0, 0, 0], loss[0, 1, 2] = [3.0, 2.0], [np.nan, 1.0]
    best = np.fmin.accumulate(loss, axis=-1)
    dims = ("replicate", "episode", "step", "solve")
    traced = record.assign(trace_loss=(dims, loss), trace_best=(dims, best))
    learning, _ = metrics.each(traced)[0]
    np.testing.assert_array_equal(learning["fit/regret"], [0.5, 0.0])
    assert "fit/regret" not in metrics.middle(metrics.all_curves(traced)[:1])
    (of_a_file,) = metrics.all_curves(traced.assign_attrs(kind="estimate"))
    assert list(of_a_file) == ["fit/regret"]


def test_what_runs_are_compared_by_tells_the_spread_of_all_samples_estimate():
    told = {
        "mu": {"estimate": 0.5, "std": 0.1, "interval": [0.3, 0.8]},
        "omega": {"estimate": 0.6, "std": None},
    }
    summary = {"late_e_total": [2.0], "pooled": {"parameters": told}, "parameters": {}}
    summary |= dict.fromkeys(("e_total", "theta_error", "field_rmse", "converged", "seconds"), 1.0)
    found = metrics.final(summary)
    assert found["pooled_std/mu"] == 0.1
    assert found["pooled_width/mu"] == pytest.approx(0.5)
    assert not any(name.startswith(("pooled_std/omega", "pooled_width/omega")) for name in found)


def test_an_estimate_from_a_file_has_neither_a_best_episode_nor_a_policy():
    told = {"mu": {"estimate": 0.5, "std": 0.1, "interval": [0.3, 0.8]}}
    summary = {"samples": {"used": 30}, "pooled": {"parameters": told}, "parameters": told}
    summary |= {"late_e_total": [2.0], "theta_error": None, "field_rmse": None, "converged": None}
    summary |= {"e_f": 1.0, "e_cv": 2.0, "e_total": 3.0, "noise": 0.7, "seconds": 4.0}
    found = metrics.final(summary)
    errors = {"e_f", "e_cv", "e_total", "noise", "samples", "seconds"}
    assert found.keys() == errors | {"pooled/mu", "pooled_std/mu", "pooled_width/mu"}
    assert (found["samples"], found["pooled/mu"]) == (30.0, 0.5)
