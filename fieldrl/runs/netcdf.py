"""Records on disk, with a checksum of their own, so that a damaged one is never taken for a result."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fieldrl.runs import atomic

if TYPE_CHECKING:
    import xarray as xr

_ENGINE = "h5netcdf"


def write(record: xr.Dataset, path: Path) -> None:
    """Write a record, complete or not at all.

    It is made in memory first: where a disk is full, HDF5 prints hundreds of lines.
    """
    atomic.write(path, bytes(record.assign_attrs(checksum=checksum(record)).to_netcdf(engine=_ENGINE)))


def read(path: Path, key: str) -> xr.Dataset | None:
    """The record of the run with this key; None where there is none or it is damaged."""
    import xarray as xr

    try:
        record = xr.load_dataset(path, engine=_ENGINE)
        whole = record.attrs.pop("checksum", "") == checksum(record)
    except Exception:  # whatever HDF5 says of a damaged file
        return None
    return record if whole and record.attrs.get("key") == key else None


def checksum(record: xr.Dataset) -> str:
    """Of every number in a record."""
    found = hashlib.blake2b(digest_size=16)
    for name in sorted(str(name) for name in record.variables):
        values = record[name].values
        if np.issubdtype(values.dtype, np.number):
            found.update(name.encode() + str(values.shape).encode() + values.astype(float).tobytes())
    return found.hexdigest()
