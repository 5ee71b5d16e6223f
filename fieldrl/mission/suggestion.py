"""Where to sample next: the places and times whose values would tell most of the unknowns of an estimate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fieldrl.core import checks, information
from fieldrl.core.checks import FieldrlError
from fieldrl.core.domain import Grid
from fieldrl.core.parameters import Parameters
from fieldrl.core.samples import Samples
from fieldrl.estimator.problem import ForwardModel
from fieldrl.mission.from_samples import domain_of
from fieldrl.uncertainty import design

_CELLS = 50  # of the grid of places along the domain's longer side


@dataclass(frozen=True, eq=False)
class Suggestion:
    """The samples to take next, the best first.

    Args:
        parameters: the unknowns.
        positions: where, (k, 2) [length].
        times: when, (k,) [time].
        predictions: values that the estimate expects there, (k,) [field unit].
        gains: what each adds to the information, after those before it, (k,) [nat].
        std: standard deviation of each unknown after 0, 1, ... k of them, (k + 1, p) [each its unit].
        map: what one sample more would gain ("gain"), and the estimated field ("field"), by time, x, y.
        record: of the estimate that it follows from.
    """

    parameters: Parameters
    positions: NDArray[np.float64]
    times: NDArray[np.float64]
    predictions: NDArray[np.float64]
    gains: NDArray[np.float64]
    std: NDArray[np.float64]
    map: xr.Dataset
    record: xr.Dataset

    @property
    def columns(self) -> Mapping[str, NDArray[np.float64]]:
        """As a table: time, x, y, prediction, gain, and the expected std of each unknown after each row."""
        named = {f"std_{name}": self.std[1:, k] for k, name in enumerate(self.parameters.names)}
        x, y = self.positions.T
        return {
            "time": self.times,
            "x": x,
            "y": y,
            "prediction": self.predictions,
            "gain": self.gains,
        } | named

    def __str__(self) -> str:
        head = "  ".join(f"{name:>11}" for name in self.columns)
        rows = np.column_stack(list(self.columns.values()))
        lines = ["  ".join(f"{value:>11.5g}" for value in row) for row in rows]
        names, units = self.parameters.names, self.parameters.units
        now = ", ".join(f"{n} {s:.3g} {u}" for n, s, u in zip(names, self.std[0], units, strict=True))
        return "\n".join([head, *lines, f"standard deviations now: {now}"])


def suggest(
    record: xr.Dataset,
    model: ForwardModel,
    count: int = 5,
    times: float | Sequence[float] | None = None,
    places: Any = None,
    reach: float | None = None,
    apart: float = 0.0,
) -> Suggestion:
    """The next samples by the estimate's Fisher information: a greedy D-optimal set, uncertainty/design.py.

    Args:
        record: of an estimate from samples.
        model: its forward model.
        count: how many samples, >= 1.
        times: when they may be taken, one or several; None: when the last sample was [time].
        places: where, (c, 2) [length]; None: a grid over the model's domain without its obstacles, or over
            the samples' surroundings where it has no domain.
        reach: at most so far from where the last sample was taken > 0; None: anywhere [length].
        apart: samples at the same time keep this distance >= 0 [length].

    Raises:
        FieldrlError: a setting is refused, or no place is left.
    """
    checks.integer("count", count, 1)
    checks.not_negative("apart", apart, "length")
    if reach is not None:
        checks.positive("reach", reach, "length")
    one, samples = record.isel(replicate=0), _samples(record)
    theta, known, noise = one["pooled"].values, one["information"].values, _noise(record)
    when = _times(times, float(record.attrs["field_time"]), model)
    grid = _grid(model, samples)
    shown = _allowed(model, samples, grid.points)
    where = _reachable(_places(places, grid.points[shown], model, samples), samples, reach)
    sites = np.concatenate([where, grid.points[shown]])  # together: a dear model is asked once
    positions, at = np.tile(sites, (len(when), 1)), np.repeat(when, len(sites))
    slopes = information.sensitivities(model, theta, positions, at, noise)
    expected = model.predict(theta[None], positions, at)[0]
    candidate = np.tile(np.arange(len(sites)) < len(where), len(when))
    positions, at, drawn = positions[candidate], at[candidate], slopes[~candidate]

    def beside(i: int) -> NDArray[np.bool_]:
        return (np.linalg.norm(positions - positions[i], axis=1) < apart) & (at == at[i])

    chosen, gains = design.greedy(known, slopes[candidate], count, beside)
    std = design.expected_std(known, slopes[candidate][chosen]) * model.parameters.half_width
    values = {"gain": design.gains(known, drawn), "field": expected[~candidate]}
    chart = _map(values, grid, shown, when)
    samples_to_take = positions[chosen], at[chosen], expected[candidate][chosen]
    return Suggestion(model.parameters, *samples_to_take, gains, std, chart, record)


def _samples(record: xr.Dataset) -> Samples:
    one = record.isel(replicate=0, episode=0)
    return Samples.of(one["measured_position"].transpose("step", "axis"), one["time"], one["value"])


def _noise(record: xr.Dataset) -> float:
    noise = float(record.attrs["noise"])
    if not (np.isfinite(noise) and noise > 0):
        raise FieldrlError("the noise is not known: too few samples to say what another one would tell")
    return noise


def _times(times: Any, last: float, model: Any) -> NDArray[np.float64]:
    """When samples may be taken, (k,)."""
    given = [last] if times is None else [times] if isinstance(times, int | float) else times
    found = np.unique(checks.vector("times", given, None, "time"))
    horizon = float(getattr(model, "horizon", np.inf))
    if not found.size or found[0] < 0 or found[-1] > horizon * (1 + 1e-12):
        hint = f"must lie between 0 and {horizon:g}, the model's last"
        raise checks.InvalidValue(
            "times", given, hint, "time", "pde.final_time extends a model that is solved"
        )
    return found


def _places(given: Any, grid: NDArray, model: Any, samples: Samples) -> NDArray[np.float64]:
    """Where samples may be taken, (c, 2): the given places that the model predicts, or the grid's."""
    if given is None:
        return grid
    where = np.atleast_2d(np.asarray(given, dtype=float))
    if where.ndim != 2 or where.shape[1] != 2 or not np.isfinite(where).all():
        raise checks.InvalidValue("places", np.shape(given), "must be finite positions, (c, 2)", "length")
    kept = where[_allowed(model, samples, where)]
    if not len(kept):
        raise FieldrlError(f"places: none of {len(where)} lies in the model's domain")
    return kept


def _reachable(where: NDArray, samples: Samples, reach: float | None) -> NDArray[np.float64]:
    """Those of the places that are near enough to the last sample's, (c, 2)."""
    if reach is None:
        return where
    near = np.linalg.norm(where - samples.positions[-1], axis=1) <= reach
    if not near.any():
        x, y = samples.positions[-1]
        raise FieldrlError(
            f"reach={reach:g}: no place is so near to the last sample's, ({x:g}, {y:g}) [length]"
        )
    return where[near]


def _grid(model: Any, samples: Samples) -> Grid:
    """About fifty cells along the longer side of the domain."""
    domain = domain_of(model, samples)
    size = np.subtract(domain.upper, domain.lower)
    nx, ny = np.maximum(1, np.round(_CELLS * size / size.max())).astype(int)
    return domain.grid(int(nx), int(ny))


def _allowed(model: Any, samples: Samples, where: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which places are water that the model predicts, (c,)."""
    inside = (
        domain_of(model, samples).contains(where) if hasattr(model, "domain") else np.ones(len(where), bool)
    )
    if hasattr(model, "admissible"):
        inside &= np.all(np.isclose(np.asarray(model.admissible(where)), where), axis=1)
    return inside


def _map(
    values: Mapping[str, NDArray[np.float64]],
    grid: Grid,
    shown: NDArray[np.bool_],
    times: NDArray[np.float64],
) -> xr.Dataset:
    """Values at the cells that are ``shown``, time by time, on the grid; NaN elsewhere."""
    found = xr.Dataset(coords={"time": times, "x": grid.x, "y": grid.y})
    for name, unit in (("gain", "nat"), ("field", "field unit")):
        cells = np.full((len(times), len(shown)), np.nan)
        cells[:, shown] = values[name].reshape(len(times), -1)
        on_grid = cells.reshape(len(times), grid.x.size, grid.y.size)
        found[name] = ("time", "x", "y"), on_grid, {"units": unit}
    return found
