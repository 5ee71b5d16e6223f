"""Draws from the posterior on disk: a group that ArviZ reads, and the same record when it is read."""

from __future__ import annotations

import numpy as np
import xarray as xr

from fieldrl.mission import run_replicate
from fieldrl.mission.record import combine
from fieldrl.posterior.emcee import Emcee
from fieldrl.runs import netcdf
from tests.unit.mission.conftest import small

SAMPLER = Emcee(walkers=6, draws=5, burn_in=1)


def test_a_record_with_draws_is_written_with_a_group_and_read_as_it_was(tmp_path):
    mission, path = small(episodes=1, evaluation_episodes=0, posterior=SAMPLER), tmp_path / "record.nc"
    record = combine([run_replicate(mission, 0, i) for i in (0, 1)], mission).assign_attrs(key="k")
    netcdf.write(record, path)
    group = xr.load_dataset(path, engine="netcdf4", group="posterior")
    assert list(group) == ["b_x", "b_y"]
    assert group["b_x"].dims == ("chain", "draw", "replicate")
    np.testing.assert_array_equal(
        group["b_y"].transpose("replicate", "chain", "draw"), record["posterior"].sel(parameter="b_y")
    )
    assert "posterior" not in xr.load_dataset(path, engine="netcdf4")
    again = netcdf.read(path, "k")
    assert again is not None
    xr.testing.assert_equal(again, record)


def test_draws_of_a_run_are_about_its_pooled_estimate_and_change_nothing_else():
    drawn, plain = (
        run_replicate(small(episodes=2, evaluation_episodes=0, posterior=one), 0, 0)
        for one in (SAMPLER, None)
    )
    xr.testing.assert_identical(drawn.drop_vars("posterior"), plain)
    low, high = drawn["pooled_interval"].transpose("end", "parameter").values
    reach = high - low
    draws = drawn["posterior"].values
    assert np.all((draws > low - 2 * reach) & (draws < high + 2 * reach))
