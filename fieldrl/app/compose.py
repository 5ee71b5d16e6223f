"""Compose a configuration in Python, as the command line does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import yaml
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra

from fieldrl.app import config as configuration
from fieldrl.app import places

if TYPE_CHECKING:
    import xarray as xr


def composed(overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The plain, checked configuration for command-line overrides such as ``["steps=10"]``.

    Raises:
        FieldrlError: a key, option or value is refused; HydraException: an override cannot be read.
    """
    GlobalHydra.instance().clear()
    with initialize_config_dir(config_dir=str(places.directory()), version_base="1.3"):
        plain = configuration.plain(compose(config_name="config", overrides=list(overrides)))
    configuration.check(plain)
    return plain


def recorded(experiment: str, overrides: Sequence[str] = ()) -> tuple[xr.Dataset, dict[str, Any]]:
    """The record and the summary of a run, computed now where no run of this configuration is finished.

    Args:
        experiment: an option of the group ``experiment``.
        overrides: as on the command line.
    """
    import xarray as xr

    from fieldrl.app.job import Job, perform

    config = composed([f"experiment={experiment}", *overrides])
    files = {"config.yaml": yaml.safe_dump(config), "overrides.yaml": yaml.safe_dump(list(overrides))}
    job = Job.of(config, experiment, files)
    summary = perform(job)
    return xr.load_dataset(job.run.folder / "record.nc", engine="h5netcdf"), summary
