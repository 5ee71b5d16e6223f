"""What rows of judged missions say: coverage, ranks, efficiency, false alarms, power. Pure functions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import binom, kstest

from fieldrl.uncertainty.misfit import LEVEL
from pipelines.calibration.cases import LEVELS

BAND = 0.95
"""Probability of every band."""

GROSS = 5.0
"""An estimate is grossly off where an unknown is so many times Cramer-Rao's bound away."""

NORMAL = 0.25
"""A likelihood is nearly normal where an interval is so near to a normal one's, relatively."""

CLASSES, FEWEST = 12, 10
"""Classes of sizes of misfits, equally many missions in each; fewer classes where these would be too few."""

Rows = Sequence[dict[str, Any]]


class Share(NamedTuple):
    """A share of N missions beside what it should be.

    Args:
        found: of each unknown, or one, (p,).
        count: N.
        low: of the binomial band of the nominal value.
        high: of it.
    """

    found: NDArray[np.float64]
    count: int
    low: float
    high: float

    @property
    def mean(self) -> float:
        """Over the unknowns."""
        return float(np.mean(self.found))

    @property
    def inside(self) -> bool:
        """Whether it is in the band for every unknown."""
        return bool(np.all((self.found >= self.low) & (self.found <= self.high)))


class Efficiency(NamedTuple):
    """Errors of the estimates on informative paths, in Cramer-Rao's bounds.

    Args:
        count: missions.
        ratio: root mean square, over the unknowns together.
        low: of its band by resampling the missions.
        high: of it.
        gross: share of missions that are grossly off.
        held: share of these whose joint region of 95 % holds the truth.
        rest: the ratio of the others.
        surpassed: missions whose estimate fits worse than another solution.
    """

    count: int
    ratio: float
    low: float
    high: float
    gross: float
    held: float
    rest: float
    surpassed: int


class Power(NamedTuple):
    """How often a wrong model is called wrong.

    Args:
        count: missions.
        told: share of all of them that are called wrong.
        size: where the classes of sizes begin that are all called wrong in 90 % or more [std of the noise].
        large: share of the missions whose misfit is so large.
        power: there.
    """

    count: int
    told: float
    size: float
    large: float
    power: float


def share(hits: Iterable[Any], nominal: float) -> Share:
    """The share of hits (N,) or (N, p), beside the band of ``nominal``."""
    values = np.array(list(hits), dtype=float)
    values = values.reshape(len(values), -1)
    low, high = binom.interval(BAND, len(values), nominal)
    return Share(values.mean(axis=0), len(values), low / len(values), high / len(values))


def coverage(rows: Rows, what: str) -> list[Share]:
    """Of the intervals (``covered``) or joint regions (``region``), at each of ``LEVELS``."""
    return [share((row[what][i] for row in rows), level) for i, level in enumerate(LEVELS)]


def against_straight(rows: Rows) -> list[Share]:
    """Coverage of the intervals, less that of a straight model's with the same noise, plus the nominal value.

    The straight model's intervals are exact, so what they miss beyond their share is the luck of the noise.
    The band is that of the difference, by its own scatter.
    """
    found = []
    for i, level in enumerate(LEVELS):
        off = np.array([np.subtract(row["covered"][i], row["straight"][i], dtype=float) for row in rows])
        reach = -ndtri((1 - BAND) / 2) * off.std(axis=0).max() / np.sqrt(len(off))
        found.append(Share(level + off.mean(axis=0), len(off), level - reach, level + reach))
    return found


class Needed(NamedTuple):
    """Samples until every interval is narrower than a width.

    Args:
        median: infinite where fewer than half of the missions come so far.
        stopped: share of the missions that do.
        held: whether the intervals hold their truth at the stop.
    """

    median: float
    stopped: float
    held: Share


def needed(rows: Rows, width: float) -> Needed:
    """Of missions that stop."""
    narrow = np.array([row["widest"] for row in rows]) < width
    stopped = narrow.any(axis=1)
    at = np.where(stopped, narrow.argmax(axis=1), -1)
    samples = np.where(stopped, at + 1.0, np.inf)
    held = [row["held"][i] for row, i in zip(rows, at, strict=True) if i >= 0]
    return Needed(float(np.quantile(samples, 0.5, method="inverted_cdf")), float(stopped.mean()),
                  share(held, 0.95) if held else Share(np.full(1, np.nan), 0, np.nan, np.nan))  # fmt: skip


class Band(NamedTuple):
    """The pointwise band of 95 % about the estimated field at the end of a mission.

    Args:
        count: missions whose band is anywhere wide enough to be looked at.
        held: mean share of its cells there that hold the true field.
        low: of its band by resampling the missions.
        high: of it.
        ratio: root mean square error of the field there over what the standard deviation says, median.
    """

    count: int
    held: float
    low: float
    high: float
    ratio: float


def band(rows: Rows) -> Band | None:
    """Of the missions whose field was looked at; None where there is none."""
    seen = [row for row in rows if row.get("field", [0, None])[1] is not None]
    if not seen:
        return None
    held = np.array([row["field"][1] for row in seen])
    again = np.random.default_rng(0).integers(len(held), size=(1000, len(held)))
    low, high = np.quantile(held[again].mean(axis=1), [(1 - BAND) / 2, (1 + BAND) / 2])
    ratio = float(np.median([row["field rms"][0] / row["field rms"][1] for row in seen]))
    return Band(len(held), float(held.mean()), float(low), float(high), ratio)


def of_size(rows: Rows, n: int) -> Rows:
    """The missions of n samples."""
    return [row for row in rows if row["n"] == n]


def informative(rows: Rows) -> Rows:
    """The missions whose path tells their truth."""
    return [row for row in rows if row["informative"]]


def normal(rows: Rows) -> Rows:
    """The informative ones whose likelihood is nearly normal: without noise, intervals of 99.99 % are as
    wide as Cramer-Rao's bound says, within ``NORMAL``."""
    return [row for row in informative(rows) if np.all(np.abs(np.array(row["normal"]) - 1.0) < NORMAL)]


def ranks(rows: Rows) -> NDArray[np.float64]:
    """Places of the truths in the told distributions, sorted, (p, N)."""
    return np.sort(np.array([row["rank"] for row in rows]).T, axis=1)


def uniform(rows: Rows) -> float:
    """Probability of ranks so far from uniform, of the unknown where it is least (Kolmogorov and Smirnov)."""
    found = ranks(rows)
    return min(1.0, len(found) * min(float(kstest(each, "uniform").pvalue) for each in found))


def efficiency(rows: Rows) -> Efficiency:
    """RMSE over Cramer-Rao's bound."""
    off = np.array([(np.array(row["estimate"]) - row["truth"]) / row["bound"] for row in rows])
    squares = np.mean(off**2, axis=1)
    again = np.random.default_rng(0).integers(len(rows), size=(1000, len(rows)))
    low, high = np.quantile(np.sqrt(squares[again].mean(axis=1)), [(1 - BAND) / 2, (1 + BAND) / 2])
    gross = np.abs(off).max(axis=1) > GROSS
    rest = float(np.sqrt(squares[~gross].mean())) if not gross.all() else np.nan
    held = np.array([row["region"][-1] for row in rows])[gross]
    return Efficiency(
        len(rows), float(np.sqrt(squares.mean())), low, high, float(gross.mean()),
        float(held.mean()) if gross.any() else np.nan, rest, sum(row["surpassed"] for row in rows),
    )  # fmt: skip


def false_alarms(rows: Rows, what: str = "p") -> Share:
    """How often a right model is called wrong."""
    return share((row[what] < LEVEL for row in rows), LEVEL)


def power(rows: Rows, name: str) -> Power:
    """How often a wrong model is called wrong, by the size of its misfit."""
    size, wrong = _tried(rows, name)
    edge = np.inf
    for low, _, told in reversed(power_by_size(rows, name)):
        if told < 0.9:
            break
        edge = low
    large = size >= edge
    there = float(wrong[large].mean()) if large.any() else np.nan
    return Power(len(size), float(wrong.mean()), edge, float(large.mean()), there)


def power_by_size(rows: Rows, name: str) -> list[tuple[float, float, float]]:
    """Of each class of sizes: its least and mean size, the share called wrong."""
    size, wrong = _tried(rows, name)
    classes = np.array_split(np.argsort(size), max(1, min(CLASSES, len(size) // FEWEST)))
    return [(float(size[at].min()), float(size[at].mean()), float(wrong[at].mean())) for at in classes]


def _tried(rows: Rows, name: str) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Size of the misfit, and whether it was called wrong, of the missions that were tried."""
    key = f"wrong {name}"
    size, p = np.array([row[key] for row in rows if key in row]).T
    return size, p < LEVEL
