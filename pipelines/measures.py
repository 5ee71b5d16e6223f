"""What is measured of a run, one number for each replicate or episode."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

LEVELS = 10  # level sets between 0 and the feature's amplitude


def final(record: xr.Dataset, variable: str) -> NDArray[np.float64]:
    """A variable after the last sample, or one that episodes have, (replicates, episodes)."""
    values = record[variable]
    values = values.isel(step=-1) if "step" in values.dims else values
    return values.transpose("replicate", "episode").values


def late(values: NDArray) -> NDArray:
    """The last quarter of the episodes, (replicates, episodes / 4)."""
    return values[:, -max(1, values.shape[1] // 4) :]


def early(values: NDArray) -> NDArray:
    """The first eighth of the episodes, (replicates, episodes / 8)."""
    return values[:, : max(1, values.shape[1] // 8)]


def error_of_theta(record: xr.Dataset) -> NDArray[np.float64]:
    """|estimate - true| after the last sample of every episode, (replicates, episodes)."""
    theta = record["theta"].isel(step=-1).transpose("replicate", "episode", "parameter").values
    return np.linalg.norm(theta - record["true"].values, axis=-1)


def of_best(record: xr.Dataset, values: NDArray) -> NDArray:
    """What (replicates, episodes, ...) values are in each replicate's best episode, (replicates, ...)."""
    return values[np.arange(len(values)), record["best_episode"].values.astype(int)]


def field_error(record: xr.Dataset) -> NDArray[np.float64]:
    """Root mean square difference of the fields at the final time, as a share of the peak, (replicates,)."""
    difference = record["field_estimate"] - record["field_true"]
    return np.sqrt((difference**2).mean(("x", "y")).values) / float(record["field_true"].max())


def followed(values: NDArray) -> NDArray[np.float64]:
    """Mean of the field along a path: how well it keeps to the feature, (..., steps) -> (...)."""
    return values.mean(axis=-1)


def crossed(values: NDArray, amplitude: float) -> NDArray[np.float64]:
    """Level sets that a path crosses from sample to sample, by the field's change, (..., steps) -> (...).

    Of the field without noise: noise of one field unit alone would make 2.1 of 20 samples.
    """
    return np.abs(np.diff(values, axis=-1)).sum(axis=-1) / (amplitude / LEVELS)


def spread_of_ends(record: xr.Dataset) -> NDArray[np.float64]:
    """How far the last samples of late episodes scatter, root mean square, (replicates,) [length]."""
    ends = record["position"].isel(step=-1).transpose("replicate", "episode", "axis").values
    ends = late(ends)
    return np.sqrt(((ends - ends.mean(axis=1, keepdims=True)) ** 2).sum(axis=-1).mean(axis=1))


def by_accuracy(record: xr.Dataset, values: NDArray) -> tuple[NDArray, NDArray]:
    """Mean of values (r, episodes) over the least and over the most accurate tenth of the episodes."""
    errors = error_of_theta(record)
    order = np.argsort(errors, axis=1)
    count = max(1, errors.shape[1] // 10)
    sorted_values = np.take_along_axis(values, order, axis=1)
    return sorted_values[:, -count:].mean(axis=1), sorted_values[:, :count].mean(axis=1)
