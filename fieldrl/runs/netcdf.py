"""Records on disk, with a checksum of their own, so that a damaged one is never taken for a result."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fieldrl.runs import atomic

if TYPE_CHECKING:
    import xarray as xr

_ENGINE = "netcdf4"
_POSTERIOR = "posterior"  # the variable that is a group of its own on disk


def write(record: xr.Dataset, path: Path) -> None:
    """Write a record, complete or not at all.

    It is made in memory first: where a disk is full, HDF5 prints hundreds of lines.
    """
    whole = record.assign_attrs(checksum=checksum(record))
    if _POSTERIOR not in record:
        atomic.write(path, bytes(whole.to_netcdf(engine=_ENGINE)))
        return
    import xarray as xr

    root = whole.drop_vars(_POSTERIOR).assign_attrs(groups=_POSTERIOR)
    groups = {"/": root, f"/{_POSTERIOR}": _by_name(record[_POSTERIOR])}
    atomic.write(path, bytes(xr.DataTree.from_dict(groups).to_netcdf(engine=_ENGINE)))


def read(path: Path, key: str) -> xr.Dataset | None:
    """The record of the run with this key; None where there is none or it is damaged."""
    import xarray as xr

    try:
        record = xr.load_dataset(path, engine=_ENGINE)
        if record.attrs.pop("groups", "") == _POSTERIOR:
            draws = xr.load_dataset(path, engine=_ENGINE, group=_POSTERIOR)
            record[_POSTERIOR] = _together(draws, record)
        whole = record.attrs.pop("checksum", "") == checksum(record)
    except Exception:  # whatever HDF5 says of a damaged file
        return None
    return record if whole and record.attrs.get("key") == key else None


def _by_name(draws: xr.DataArray) -> xr.Dataset:
    """The posterior as ArviZ reads it: a variable for each unknown, its dimensions chain, draw, replicate."""
    ordered = draws.transpose("parameter", "chain", "draw", "replicate")
    names = [str(name) for name in draws["parameter"].values]
    found = {name: part.drop_vars("parameter") for name, part in zip(names, ordered, strict=True)}
    return next(iter(found.values())).to_dataset(name=names[0]).assign(found)


def _together(draws: xr.Dataset, record: xr.Dataset) -> xr.DataArray:
    """The same as it is in the record in memory."""
    import xarray as xr

    names = [str(name) for name in record["parameter"].values]
    whole = xr.concat([draws[name] for name in names], dim="parameter").assign_coords(parameter=names)
    return whole.transpose("replicate", "chain", "draw", "parameter")


def checksum(record: xr.Dataset) -> str:
    """Of every number in a record."""
    found = hashlib.blake2b(digest_size=16)
    for name in sorted(str(name) for name in record.variables):
        values = record[name].values
        if np.issubdtype(values.dtype, np.number):
            found.update(name.encode() + str(values.shape).encode() + values.astype(float).tobytes())
    return found.hexdigest()
