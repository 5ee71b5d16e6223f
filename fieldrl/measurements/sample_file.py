"""Samples from a file or a table: which columns, in which units, and what of them cannot be used.

A bad file is refused in one to three lines. Rows that cannot be used are left out and counted, by reason;
what was understood of the file is told in notes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.kinds import component
from fieldrl.core.samples import Samples
from fieldrl.measurements import columns, delimited, gridded, numbers, table, units
from fieldrl.measurements.table import Table, Unreadable

_TEXT = (".csv", ".tsv", ".txt", ".dat")
_PARQUET = (".parquet", ".pq")
_NETCDF = (".nc", ".nc4", ".cdf", ".netcdf", ".h5")
_UNITS = {"length": units.LENGTHS, "time": units.TIMES}

_LARGEST = 1e30  # of a number in a file

INCOMPLETE = "a number is missing"
REPEATED = "the same row again"
THINNED = "measurements.thin"


@dataclass(frozen=True, eq=False)
class Reading:
    """What was read.

    Args:
        source: from where.
        samples: what can be used, in order of time.
        rows: how many there were.
        dropped: how many rows were left out, by reason.
        notes: what was understood, a line each.
        time_zero: the date and time that is the model's time 0, where the file has dates; else "".
        degrees: whether the file has longitudes and latitudes.
    """

    source: str
    samples: Samples
    rows: int
    dropped: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    time_zero: str = ""
    degrees: bool = False

    def less(self, keep: NDArray[np.bool_], reason: str) -> Reading:
        """Without the samples that are not to be kept (n,), counted under a reason."""
        count = int(np.count_nonzero(~keep))
        if not count:
            return self
        return replace(self, samples=self.samples.where(keep), dropped={**self.dropped, reason: count})


@component
class SampleFile:
    """How a file of samples is read.

    Args:
        columns: name of the column of each role (time, x, y, value, std, censored); null: found by its name
            or its CF standard name.
        units: what the model's units are: length ("1 km") and time ("6 h"); null: the file has the model's.
        origin: where the model's (0, 0) is, as (x, y) or (longitude, latitude) of the file; null: (0, 0), and
            must be given for longitudes.
        start: date and time of the model's time 0; null: the first sample's, where the file has dates.
        time_format: of dates in text, as ``datetime.strptime`` reads it; null: the usual ones.
        std: standard deviation of each value's noise, where no column says it [field unit].
        detection_limit: a value at or below this says no more than that [field unit].
        thin: every so manieth sample is used.
        select: one index of a dimension of a NetCDF file that is not wanted, such as {depth: 0}.
        replicate: whose samples are read from the record of a run.
        encoding: of a text file.
        decimal: mark before the decimal digits of a text file.
    """

    columns: Mapping[str, Any] = field(default_factory=dict)
    units: Mapping[str, Any] = field(default_factory=dict)
    origin: Sequence[float] | None = None
    start: str | None = None
    time_format: str | None = None
    std: float | None = None
    detection_limit: float | None = None
    thin: int = 1
    select: Mapping[str, Any] = field(default_factory=dict)
    replicate: int = 0
    encoding: str = "utf-8"
    decimal: str = "."

    def __post_init__(self) -> None:
        _texts("columns", self.columns, columns.ROLES)
        _texts("units", self.units, tuple(_UNITS))
        for name, text in self.units.items():
            if text is not None:
                units.amount(f"units.{name}", text, _UNITS[name])
        if self.origin is not None:
            checks.vector("origin", self.origin, 2)
        if self.std is not None:
            checks.positive("std", self.std, "field unit")
        if self.detection_limit is not None:
            checks.number("detection_limit", self.detection_limit, "field unit")
        for dim, index in self.select.items():
            checks.integer(f"select.{dim}", index)
        checks.integer("thin", self.thin, 1)
        checks.integer("replicate", self.replicate, 0)
        checks.one_of("decimal", self.decimal, (".", ","))

    def read(self, path: str | Path) -> Reading:
        """The samples in a file, in the units of the model.

        Args:
            path: CSV, Parquet or NetCDF by its ending; a run's folder stands for its record.

        Raises:
            Unreadable: what is wrong with the file.
        """
        path = Path(path).expanduser()
        path = path / "record.nc" if path.is_dir() and (path / "record.nc").exists() else path
        if not path.is_file():
            raise Unreadable(
                str(path), "is a folder without record.nc" if path.is_dir() else "there is no such file"
            )
        if path.suffix.lower() in _NETCDF:
            return self._netcdf(path)
        if path.suffix.lower() in _PARQUET:
            return self.of(_parquet(path))
        if path.suffix.lower() in _TEXT:
            return self.of(delimited.read(path, self.encoding))
        endings = ", ".join((*_TEXT, *_PARQUET, *_NETCDF))
        raise Unreadable(str(path), f"the file's ending says what it is; it must be one of {endings}")

    def of(self, content: Any) -> Reading:
        """The samples in a table, a pandas DataFrame, or a mapping of columns; as ``read``."""
        if isinstance(content, Samples):
            return self._reduced(Reading("samples", self._stated(content), len(content)))
        rows = content if isinstance(content, Table) else table.of_columns(content)
        chosen = columns.chosen(rows.columns, self.columns, rows.source)
        if not len(rows):
            raise Unreadable(rows.source, "has no rows below the names of its columns")
        time, start = self._times(rows, chosen["time"])
        positions, degrees = self._positions(rows, chosen)
        values, censored, std = self._values(rows, chosen)
        _check_size(rows.source, time=time, x=positions[:, 0], y=positions[:, 1], value=values)
        complete = np.isfinite(time) & np.isfinite(positions).all(axis=1) & np.isfinite(values)
        if std is not None:
            complete &= np.isfinite(std)
            std = np.where(complete, std, 1.0)
        everything = Samples.of(positions, time, values, std, censored)
        notes = self._notes(start, degrees)
        reading = Reading(rows.source, everything, len(rows), {}, notes, start, degrees)
        return self._reduced(_in_order(reading.less(complete, INCOMPLETE)))

    def _notes(self, start: str, degrees: bool) -> tuple[str, ...]:
        """What was understood of dates, longitudes and latitudes."""
        first = f"time 0 is the first sample's, {start} UTC (measurements.start)"
        plane = "east and north of measurements.origin by the equirectangular projection"
        return (*([first] if start and not self.start else []), *([plane] if degrees else []))

    def places(self, path: str | Path) -> NDArray[np.float64]:
        """The positions in a text file with columns for x and y, in the units of the model, (c, 2).

        Raises:
            Unreadable: what is wrong with the file.
        """
        path = Path(path).expanduser()
        if not path.is_file():
            raise Unreadable(str(path), "there is no such file")
        rows = delimited.read(path, self.encoding)
        positions, _ = self._positions(
            rows, columns.chosen(rows.columns, self.columns, str(path), ("x", "y"))
        )
        if not len(positions) or not np.isfinite(positions).all():
            raise Unreadable(str(path), "must hold a number for x and y in every row, and at least one row")
        return positions

    def degrees_of(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Longitudes and latitudes of positions of the model (n, 2), (n, 2) [degree]."""
        length = self.units.get("length")
        metres = positions * units.amount("units.length", length, units.LENGTHS) if length else positions
        origin = self.origin or (0.0, 0.0)
        return units.sphere(metres, (float(origin[0]), float(origin[1])))

    def seconds_of(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Times of the model (n,) in seconds since its time 0, (n,)."""
        time = self.units.get("time")
        return times * units.amount("units.time", time, units.TIMES) if time else times

    def _netcdf(self, path: Path) -> Reading:
        with gridded.opened(path) as data:
            if gridded.is_record(data):
                samples = self._stated(gridded.recorded(data, self.replicate, str(path)))
                reading = Reading(str(path), samples, len(samples))
                return self._reduced(reading.less(np.isfinite(samples.values), INCOMPLETE))
            chosen = columns.chosen(gridded.columns(data), self.columns, str(path))
            return self.of(gridded.table(data, chosen, self.select, str(path)))

    def _reduced(self, reading: Reading) -> Reading:
        """Without rows that are there twice, and thinned."""
        samples = reading.samples
        if not len(samples):
            return reading
        content = np.column_stack([samples.times, samples.positions, samples.values])
        _, first = np.unique(content, axis=0, return_index=True)
        reading = reading.less(np.isin(np.arange(len(samples)), first), REPEATED)
        return reading.less(np.arange(len(reading.samples)) % self.thin == 0, THINNED)

    def _stated(self, samples: Samples) -> Samples:
        """With the noise and the detection limit of the settings, where the samples say nothing."""
        std, below = samples.std, samples.censored
        if std is None and self.std is not None:
            std = np.full(len(samples), self.std)
        if self.detection_limit is not None:
            low = samples.values <= self.detection_limit
            below = low if below is None else below | low
            values = np.maximum(samples.values, self.detection_limit)
            return Samples.of(samples.positions, samples.times, values, std, below)
        return Samples.of(samples.positions, samples.times, samples.values, std, below)

    def _times(self, rows: Table, key: str) -> tuple[NDArray[np.float64], str]:
        """Times of the model, NaN where there are none, and the date of its time 0 where it has one."""
        unit, source = rows.columns[key].unit, rows.source
        found = numbers.dates(rows.frame[key], self.time_format, source)
        if found is None:
            time = numbers.numbers(rows.frame[key], "time", self.decimal, source)
            return time * self._factor("time", unit, source), ""
        known = found[~np.isnat(found)]
        first = known.min() if known.size else np.datetime64("1970-01-01")
        start = first if self.start is None else _moment(self.start)
        seconds = (found - start) / np.timedelta64(1, "ns") * 1e-9
        elapsed = np.where(np.isnat(found), np.nan, seconds) * self._factor("time", "s", source)
        return elapsed, str(start)[:19]

    def _positions(self, rows: Table, chosen: Mapping[str, str]) -> tuple[NDArray[np.float64], bool]:
        """Positions of the model (n, 2), NaN where there are none, and whether they were in degrees."""
        x, y = (numbers.numbers(rows.frame[chosen[axis]], axis, self.decimal, rows.source) for axis in "xy")
        said = [rows.columns[chosen[axis]] for axis in "xy"]
        degrees = [columns.in_degrees(column) for column in said]
        if any(degrees):
            if not all(degrees):
                raise Unreadable(rows.source, "one of x and y is in degrees, the other is not")
            if self.origin is None:
                span = f"they span {_span(x)} and {_span(y)}"
                raise Unreadable(
                    rows.source,
                    f"longitudes and latitudes need the place of the model's (0, 0); {span}:\n"
                    "'measurements.origin=[LONGITUDE,LATITUDE]'",
                )
            east, north = units.plane(x, y, (float(self.origin[0]), float(self.origin[1])))
            positions = np.column_stack([east, north]) * self._factor("length", "m", rows.source)
            return positions, True
        origin = self.origin or (0.0, 0.0)
        scale = [self._factor("length", column.unit, rows.source) for column in said]
        return np.column_stack([(x - origin[0]) * scale[0], (y - origin[1]) * scale[1]]), False

    def _values(
        self, rows: Table, chosen: Mapping[str, str]
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_] | None, NDArray[np.float64] | None]:
        """Values, which of them are detection limits, and their standard deviations."""
        column, censored = numbers.limits(rows.frame[chosen["value"]])
        values = numbers.numbers(column, "value", self.decimal, rows.source)
        if "censored" in chosen:
            flags = numbers.numbers(rows.frame[chosen["censored"]], "censored", self.decimal, rows.source)
            censored = censored | (flags > 0)
        if self.detection_limit is not None:
            censored = censored | (values <= self.detection_limit)
            values = np.where(censored, np.maximum(values, self.detection_limit), values)
        if "std" not in chosen:
            return values, censored, None if self.std is None else np.full(len(values), float(self.std))
        said, of_value = rows.columns[chosen["std"]].unit, rows.columns[chosen["value"]].unit
        if said and of_value and said != of_value:
            raise Unreadable(
                rows.source, f"std is in {said}, value in {of_value}: they must have the same unit"
            )
        std = numbers.numbers(rows.frame[chosen["std"]], "std", self.decimal, rows.source)
        wrong = np.flatnonzero(std <= 0)
        if wrong.size:
            raise Unreadable(
                rows.source, f"std: row {wrong[0] + 1} holds {std[wrong[0]]:g}, which must be > 0"
            )
        return values, censored, std

    def _factor(self, quantity: str, unit: str, source: str) -> float:
        """What a number in the file's unit is multiplied by."""
        own, known = self.units.get(quantity), _UNITS[quantity]
        if unit in ("", "1", quantity):
            return 1.0
        if unit not in known:
            problem = f"{quantity} is in {unit!r}, which is none of {', '.join(known)}"
            raise Unreadable(source, f"{problem}, or {quantity} for the model's own unit")
        if own is None:
            example = "1 km" if quantity == "length" else "6 h"
            problem = (
                f"{quantity} is in {unit}, the model counts in units of its own;\nsay what one of these is"
            )
            raise Unreadable(source, f"{problem}: 'measurements.units.{quantity}={example}'")
        return known[unit] / units.amount(f"units.{quantity}", own, known)


def _check_size(source: str, **columns: NDArray[np.float64]) -> None:
    """Refuse what no sensor measures, and what cannot be squared."""
    for role, column in columns.items():
        wrong = np.flatnonzero(np.isfinite(column) & (np.abs(column) > _LARGEST))
        if wrong.size:
            problem = (
                f"{role}: row {wrong[0] + 1} holds {column[wrong[0]]:g}, which is too large to be measured"
            )
            raise Unreadable(source, f"{problem} (at most {_LARGEST:g})")


def _parquet(path: Path) -> Table:
    import pandas as pd

    try:
        return table.of_columns(pd.read_parquet(path).reset_index(drop=True), str(path))
    except Unreadable:
        raise
    except Exception as error:  # whatever pyarrow raises
        raise Unreadable(
            str(path), f"cannot be read as Parquet: {' '.join(str(error).split())[:100]}"
        ) from error


def _in_order(reading: Reading) -> Reading:
    """In order of time; rows of the same time stay as they were."""
    times = reading.samples.times
    if np.all(np.diff(times) >= 0):
        return reading
    late = int(np.count_nonzero(np.diff(times) < 0))
    note = f"put in order of time ({late} row{'s' if late > 1 else ''} came before an earlier one)"
    samples = reading.samples.where(np.argsort(times, kind="stable"))
    return replace(reading, samples=samples, notes=(*reading.notes, note))


def _texts(key: str, given: Mapping[str, Any], known: tuple[str, ...]) -> None:
    for name, text in given.items():
        if name not in known:
            raise checks.InvalidValue(
                f"{key}.{name}", text, "unknown key", remedy=f"known are {', '.join(known)}"
            )
        if text is not None and not isinstance(text, str):
            raise checks.InvalidValue(f"{key}.{name}", text, "must be text")


def _moment(text: str) -> np.datetime64:
    import pandas as pd

    found = pd.to_datetime(text, errors="coerce", utc=True)
    if found is pd.NaT:
        raise checks.InvalidValue(
            "measurements.start", text, "must be a date and time, such as 2023-04-20T10:00"
        )
    return found.tz_localize(None).to_datetime64()


def _span(values: NDArray[np.float64]) -> str:
    known = values[np.isfinite(values)]
    return f"{known.min():.5g} to {known.max():.5g}" if known.size else "nothing"
