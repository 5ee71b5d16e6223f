"""A made-up record of the shape that a run leaves."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr


def _plume(x, y, centre, scale):
    return 30 * np.exp(-((x[:, None] - centre[0]) ** 2 + (y[None, :] - centre[1]) ** 2) / (2 * scale**2))


def _walk(rng, shape, upper):
    """Smooth random walks in the domain, (*shape, 2)."""
    heading = np.cumsum(rng.normal(0, 0.25, shape), axis=-1) + np.pi / 4
    steps = 0.04 * max(upper) * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return np.clip(np.array([20.0, 20.0]) + np.cumsum(steps, axis=-2), 0, upper)


def _errors(rng, shape):
    """e_total that falls to about 2 during the run, (replicate, episode, step)."""
    fall = 8 * np.exp(-np.arange(shape[1]) / (0.2 * shape[1] + 1))
    return (2 + fall[None, :, None]) * rng.chisquare(20, shape) / 20


def build(
    replicates=1,
    episodes=40,
    steps=20,
    upper=(200.0, 200.0),
    cells=(60, 50),
    obstacles=(),
    seed=0,
    traces=False,
):
    """A record with every variable that a figure reads; see the architecture page for its shape."""
    rng = np.random.default_rng(seed)
    shape = (replicates, episodes, steps)
    x, y = ((np.arange(n) + 0.5) * length / n for n, length in zip(cells, upper, strict=True))
    centre = 0.6 * np.asarray(upper)
    e_total = _errors(rng, shape)
    estimate = [_plume(x, y, centre + rng.normal(0, 2, 2), 0.12 * max(upper)) for _ in range(replicates)]
    each = ("replicate", "episode", "step")
    record = xr.Dataset(
        {
            "position": ((*each, "axis"), _walk(rng, shape, upper), {"units": "length"}),
            "time": (each, np.broadcast_to(np.arange(1.0, steps + 1), shape).copy(), {"units": "time"}),
            "e_total": (each, e_total, {"units": "field unit^2"}),
            "pooled_residual": (each, rng.normal(0, 1, shape), {"units": "field unit"}),
            "return": (("replicate", "episode"), 20 - e_total.sum(-1) / 10, {"units": "1"}),
            "best_episode": (("replicate",), e_total[:, :, -1].argmin(axis=1)),
            "start": (("axis",), np.array([20.0, 20.0]), {"units": "length"}),
            "field_true": (("x", "y"), _plume(x, y, centre, 0.12 * max(upper)), {"units": "field unit"}),
            "field_estimate": (("replicate", "x", "y"), np.array(estimate), {"units": "field unit"}),
        },
        coords={"x": x, "y": y},
        attrs={
            "experiment": "made_up",
            "key": "0123456789ab",
            "version": "0.1.0",
            "noise": 1.0,
            "domain_lower": (0.0, 0.0),
            "domain_upper": upper,
            "obstacles": json.dumps(list(obstacles)),
            "length_unit": "length",
            "time_unit": "time",
            "field_unit": "field unit",
        },
    )
    record = record.assign(_course(record, rng))
    return record.assign(trace_best=_traces(rng)) if traces else record


def _course(record, rng):
    """The field at every other sample, and what samples said."""
    shape = tuple(record.sizes[name] for name in ("replicate", "episode", "step"))
    each, moments = ("replicate", "episode", "step"), np.arange(0, shape[2], 2)
    field = record["field_true"].values[None, ::2, ::2] * np.linspace(1, 0.5, len(moments))[:, None, None]
    return {
        "value": (each, rng.normal(10, 3, shape)),
        "theta": ((*each, "parameter"), rng.normal(5, 1, (*shape, 2))),
        "parameter": (("parameter",), ["b_x", "b_y"]),
        "field_course": (("moment", "course_x", "course_y"), field.astype(np.float32)),
        "course_step": (("moment",), moments),
        "course_x": (("course_x",), record.x.values[::2]),
        "course_y": (("course_y",), record.y.values[::2]),
    }


def _traces(rng):
    """Best losses of 10 x 5 fits that end after 8 to 25 solves, (episode, step, solves)."""
    best = np.minimum.accumulate(10 ** rng.normal(1, 1.2, (10, 5, 25)), axis=-1)
    ends = rng.integers(8, 26, (10, 5, 1))
    best = np.where(np.arange(25) < ends, best, np.nan)
    return xr.DataArray(best, dims=("fit_episode", "fit_step", "solves"), attrs={"units": "field unit^2"})


@pytest.fixture
def make_record():
    """The builder of made-up records."""
    return build


@pytest.fixture
def obstacles():
    """One obstacle of each kind."""
    return (
        {"kind": "rectangle", "lower": [60.0, 10.0], "upper": [90.0, 30.0]},
        {"kind": "circle", "centre": [150.0, 40.0], "radius": 12.0},
    )
