"""Metrics of a record: names, series by episode, medians."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from fieldrl.app import metrics


@pytest.fixture
def record() -> xr.Dataset:
    """Two replicates, four episodes, three steps, one evaluation episode, one parameter."""
    rng = np.random.default_rng(0)
    variables: dict = {}
    for prefix, episodes in (("", 4), ("evaluation_", 1)):
        dims = ("replicate", f"{prefix}episode", "step")
        for name in ("e_f", "e_cv", "e_total"):
            variables[prefix + name] = (dims, rng.random((2, episodes, 3)))
        variables[f"{prefix}theta"] = ((*dims, "parameter"), rng.random((2, episodes, 3, 1)))
        variables[f"{prefix}return"] = (dims[:2], rng.random((2, episodes)))
    variables["forward_solves"] = (("replicate", "episode"), rng.integers(1, 9, (2, 4)))
    return xr.Dataset(variables | {"true": ("parameter", [0.5])}, {"parameter": ["mu"]})


def test_a_series_holds_the_value_at_the_end_of_each_episode(record):
    learning, greedy = metrics.each(record)[1]
    np.testing.assert_array_equal(learning["e_total"], record["e_total"][1, :, -1])
    np.testing.assert_array_equal(learning["theta.mu"], record["theta"][1, :, -1, 0])
    np.testing.assert_allclose(learning["theta_error"], abs(record["theta"][1, :, -1, 0] - 0.5))
    assert greedy["evaluation/return"].shape == (1,)


def test_a_parameter_that_nobody_knows_has_no_error(record):
    learning, _ = metrics.each(record.assign(true=("parameter", [np.nan])))[0]
    assert "theta_error" not in learning


def test_medians_are_taken_over_the_replicates(record):
    middle = metrics.middle(metrics.each(record))
    np.testing.assert_allclose(middle["return"], record["return"].mean("replicate"))


def test_without_evaluation_episodes_there_is_nothing_greedy(record):
    empty = record.isel(evaluation_episode=slice(0, 0))
    assert metrics.greedy(metrics.each(empty)) == []


def test_the_late_total_error_is_the_mean_of_the_last_quarter(record):
    assert metrics.late(metrics.each(record)) == pytest.approx(record["e_total"][:, -1, -1].values)


def test_the_course_of_the_fits_is_told_solve_by_solve_without_padding_and_failures(record):
    loss = np.full((2, 4, 3, 2), np.nan)
    loss[0, 0, 0], loss[0, 1, 2] = [3.0, 2.0], [np.nan, 1.0]
    best = np.fmin.accumulate(loss, axis=-1)
    dims = ("replicate", "episode", "step", "solve")
    traced = record.assign(trace_loss=(dims, loss), trace_best=(dims, best))
    learning, _ = metrics.each(traced)[0]
    np.testing.assert_array_equal(learning["fit/loss"], [3.0, 2.0, 1.0])
    np.testing.assert_array_equal(learning["fit/best_loss"], [3.0, 2.0, 1.0])
    assert "fit/loss" not in metrics.middle(metrics.each(traced))
