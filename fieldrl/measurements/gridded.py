"""Tables in NetCDF files: CF trajectories, profiles and grids alike, and the records of runs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldrl.core.samples import Samples
from fieldrl.measurements.table import Column, Table, Unreadable

if TYPE_CHECKING:
    import xarray as xr

_MOST = 5_000_000  # rows that a table may have
_AXES = {"T": "time", "X": "projection_x_coordinate", "Y": "projection_y_coordinate"}


def opened(path: Path) -> xr.Dataset:
    """The data set in a file, its times decoded, loaded only where it is looked at.

    Raises:
        Unreadable: it is no NetCDF, or its times cannot be decoded.
    """
    import xarray as xr

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of coordinates that are not needed
            return xr.open_dataset(path, decode_timedelta=False)
    except Exception as error:  # whatever HDF5, the backends or the decoding raise
        raise Unreadable(str(path), f"cannot be read as NetCDF: {_first(error)}") from error


def columns(data: xr.Dataset) -> dict[str, Column]:
    """What is said of each variable that holds numbers or times."""
    found = {}
    for name in data.variables:
        variable = data[name]
        if variable.dtype.kind in "iufMO":
            standard = variable.attrs.get("standard_name", "") or _AXES.get(
                variable.attrs.get("axis", ""), ""
            )
            found[str(name)] = Column(str(name), str(variable.attrs.get("units", "")), str(standard))
    return found


def table(data: xr.Dataset, chosen: Mapping[str, str], select: Mapping[str, int], source: str) -> Table:
    """The rows of some variables, each repeated along the dimensions that it lacks.

    Args:
        data: the data set.
        chosen: variable by role; that of "value" has all dimensions.
        select: one index of a dimension that is not wanted.
        source: the file, for messages.

    Raises:
        Unreadable: the variables do not belong together, or are too many.
    """
    said = columns(data)
    data = _one_of_each(data[list(dict.fromkeys(chosen.values()))], chosen, select, source)
    value = data[chosen["value"]]
    for role, name in chosen.items():
        foreign = [str(dim) for dim in data[name].dims if dim not in value.dims]
        if foreign:
            problem = f"{role}={name} has the dimension {foreign[0]}, which value={chosen['value']} has not"
            raise Unreadable(source, problem)
    if value.size > _MOST:
        problem = f"has {value.size} values, more than {_MOST}; take a part of them first"
        raise Unreadable(source, f"{chosen['value']} {problem}")
    if not value.dims:
        data = data.expand_dims("row")
    frame = data.to_dataframe(dim_order=[str(dim) for dim in data[chosen["value"]].dims]).reset_index()
    return Table(source, {name: said[name] for name in chosen.values()}, frame)


def is_record(data: xr.Dataset) -> bool:
    """Whether a data set is the record of a run."""
    return "measured_position" in data and {"replicate", "episode", "step"} <= set(data.sizes)


def recorded(data: xr.Dataset, replicate: int, source: str) -> Samples:
    """All samples that a replicate took while it learned, as they were fitted, with the sensor's noise.

    Raises:
        Unreadable: there is no such replicate.
    """
    count = data.sizes["replicate"]
    if replicate >= count:
        raise Unreadable(source, f"has {count} replicates: measurements.replicate must be below {count}")
    one = data.isel(replicate=replicate)
    std = one["std"].values.ravel() if "std" in one else None
    censored = one["censored"].values.ravel() > 0 if "censored" in one else None
    position = one["measured_position"].transpose("episode", "step", "axis").values
    if std is not None and not np.isfinite(std).all():
        std = None
    if "std" not in one and data.attrs.get("noise", 0) > 0:
        std = np.full(one["value"].size, float(data.attrs["noise"]))
    return Samples.of(position, one["time"].values, one["value"].values, std, censored)


def _one_of_each(
    data: xr.Dataset, chosen: Mapping[str, str], select: Mapping[str, int], source: str
) -> xr.Dataset:
    """Without the dimensions along which nothing but the value varies."""
    for dim, index in select.items():
        size = data.sizes.get(dim)
        if size is None or not -size <= index < size:
            has = ", ".join(f"{name} ({length})" for name, length in data.sizes.items())
            raise Unreadable(source, f"measurements.select.{dim}={index}: the dimensions here are {has}")
    data = data.isel(dict(select))
    placed: set[Any] = set()
    for role in ("time", "x", "y"):
        placed |= set(data[chosen[role]].dims)
    for dim in data[chosen["value"]].dims:
        if dim not in placed and data.sizes[dim] > 1 and data[chosen["time"]].ndim:
            problem = f"{chosen['value']} has {data.sizes[dim]} values along {dim} at each time and place"
            raise Unreadable(source, f"{problem}; choose one: +measurements.select.{dim}=0")
    return data


def _first(error: BaseException) -> str:
    return " ".join(str(error).split()).partition(". ")[0][:160] or type(error).__name__
