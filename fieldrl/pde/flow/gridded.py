"""A flow from arrays: a forecast, a reanalysis, a measured current field.

| symbol | meaning | shape |
|---|---|---|
| x, y, t | coordinates, increasing | (nx,), (ny,), (nt,) |
| u, v | velocity | (nt, nx, ny) |
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numba import carray, cfunc, njit  # pyright: ignore[reportPrivateImportUsage]
from numpy.typing import ArrayLike, NDArray

from fieldrl.core import checks
from fieldrl.core.compiled import FLOW
from fieldrl.core.kinds import component
from fieldrl.pde.flow.contract import parameters, points

_NAMES = ("x", "y", "t", "u", "v")


@component
class GriddedFlow:
    """Velocities on a grid, times a factor; linear between grid points and times, held beyond them.

    Linear interpolation keeps neither the divergence of the data nor its smoothness; the conservative
    equation holds for whatever flow results.

    Args:
        path: a file with x (nx,), y (ny,) [length], t (nt,) [time], and u, v (nt, nx, ny) or, where the flow
            is steady, (nx, ny) without t [length/time]; NumPy (.npz) or NetCDF (.nc).
        name: of the factor, the only parameter.
        contents: a digest of what the file holds.
    """

    path: str | os.PathLike[str]
    name: str = "factor"
    contents: str = field(init=False, default="")

    units = ("1",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", os.fspath(self.path))
        digest = hashlib.blake2b(self.constants.tobytes(), digest_size=8).hexdigest()
        object.__setattr__(self, "contents", digest)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the factor."""
        return (self.name,)

    @cached_property
    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """x, y, t, u, v of the file, checked."""
        return _checked(_read(str(self.path)), str(self.path))

    @cached_property
    def constants(self) -> NDArray[np.float64]:
        """Sizes, coordinates and velocities, one after the other, as the compiled function reads them."""
        sizes = [float(self.arrays[name].size) for name in ("x", "y", "t")]
        return np.concatenate([sizes, *(self.arrays[name].ravel() for name in _NAMES)])

    @property
    def kernel(self) -> int:
        """Address of the compiled FLOW function."""
        return int(_gridded.address or 0)

    def velocity(self, theta: ArrayLike, positions: ArrayLike, time: float) -> NDArray[np.float64]:
        """Velocity [length/time] at positions (n, 2) [length], (n, 2)."""
        places = np.ascontiguousarray(points(positions))
        found = np.empty(places.shape)
        _at_points(self.constants, places, float(time), found)
        return parameters(theta, 1)[0] * found


def _read(path: str) -> dict[str, Any]:
    """The arrays of a file, by name."""
    if not Path(path).is_file():
        raise checks.InvalidValue("path", path, "is no file")
    try:
        if path.endswith(".npz"):
            with np.load(path, allow_pickle=False) as file:
                return {name: file[name] for name in _NAMES if name in file}
        import xarray as xr

        with xr.open_dataset(path, engine="netcdf4", decode_times=False) as data:
            order = [name for name in ("t", "x", "y") if name in data.dims]
            return {
                name: data[name].transpose(*order).values if name in ("u", "v") else data[name].values
                for name in _NAMES
                if name in data
            }
    except (OSError, ValueError, KeyError) as error:
        reason = " ".join(str(error).split())[:100]
        raise checks.InvalidValue("path", path, f"cannot be read: {reason}") from None


def _checked(found: dict[str, Any], path: str) -> dict[str, NDArray[np.float64]]:
    """The arrays as they should be; raises InvalidValue("path", ...)."""

    def refuse(rule: str) -> checks.InvalidValue:
        return checks.InvalidValue("path", path, rule, remedy="see docs/flows.md")

    missing = [name for name in ("x", "y", "u", "v") if name not in found]
    if missing:
        raise refuse(f"must have {', '.join(missing)}")
    if "t" not in found:
        steady = {name: np.asarray(found[name])[None] for name in ("u", "v")}
        found = found | steady | {"t": np.zeros(1)}
    arrays = {name: np.ascontiguousarray(found[name], dtype=float) for name in _NAMES}
    for name in ("x", "y", "t"):
        axis = arrays[name]
        if axis.ndim != 1 or (name != "t" and axis.size < 2) or (np.diff(axis) <= 0).any():
            raise refuse(f"must have {name} in increasing order")
    shape = tuple(arrays[name].size for name in ("t", "x", "y"))
    for name in ("u", "v"):
        if arrays[name].shape != shape:
            raise refuse(f"must have {name} of shape {shape}, (t, x, y), not {arrays[name].shape}")
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise refuse(f"must have finite numbers only; {name} has others")
    return arrays


@njit(cache=True, error_model="numpy")
def _place(axis, value):
    """The interval of ``axis`` that ``value`` is in, and how far in, within [0, 1]."""
    if axis.size == 1 or value <= axis[0]:
        return 0, 0.0
    if value >= axis[-1]:
        return axis.size - 2, 1.0
    k = np.searchsorted(axis, value, side="right") - 1
    return k, (value - axis[k]) / (axis[k + 1] - axis[k])


@njit(cache=True, error_model="numpy")
def _interpolate(constants, x, y, t):
    """(u, v) at one point, of factor 1."""
    nx, ny, nt = int(constants[0]), int(constants[1]), int(constants[2])
    at = 3
    i, a = _place(constants[at : at + nx], x)
    j, b = _place(constants[at + nx : at + nx + ny], y)
    k, c = _place(constants[at + nx + ny : at + nx + ny + nt], t)
    first = at + nx + ny + nt
    u, v = 0.0, 0.0
    for later in range(2 if nt > 1 else 1):
        weight_t = c if later else 1.0 - c
        for right in range(2):
            weight_x = a if right else 1.0 - a
            for up in range(2):
                weight = weight_t * weight_x * (b if up else 1.0 - b)
                place = first + ((k + later) * nx + i + right) * ny + j + up
                u += weight * constants[place]
                v += weight * constants[place + nt * nx * ny]
    return u, v


@njit(cache=True, error_model="numpy")
def _at_points(constants, places, t, out):
    for n in range(places.shape[0]):
        out[n, 0], out[n, 1] = _interpolate(constants, places[n, 0], places[n, 1], t)


@cfunc(FLOW, cache=True)
def _gridded(theta, constants, x, y, t, velocity):
    nx, ny, nt = int(constants[0]), int(constants[1]), int(constants[2])
    size = 3 + nx + ny + nt + 2 * nt * nx * ny
    u, v = _interpolate(carray(constants, (size,)), x, y, t)
    velocity[0] = theta[0] * u
    velocity[1] = theta[0] * v
