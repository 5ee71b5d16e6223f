"""What a result means, in sentences, from its summary alone; terminal, MLflow and report say the same."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_LISTING = re.compile(r"Told by the samples: .*?\)\.(?: |$)")
"""The part of a verdict that lists estimates and intervals, which stand in the first sentence already."""


@dataclass(frozen=True)
class Estimate:
    """What is known of a parameter.

    Args:
        name: of the parameter.
        unit: its unit.
        value: the estimate.
        interval: (low, high) of its 95 % interval; None where there is none.
        true: the true value; None where nobody knows it.
        identified: whether the samples determine it.
    """

    name: str
    unit: str
    value: float
    interval: tuple[float, float] | None = None
    true: float | None = None
    identified: bool = True

    @property
    def holds(self) -> bool | None:
        """Whether the interval holds the true value; None where one of them is unknown."""
        if self.interval is None or self.true is None:
            return None
        return self.interval[0] <= self.true <= self.interval[1]

    def __str__(self) -> str:
        """``omega = 0.6287 ± 0.0021 rad/time``."""
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        return f"{self.name} = {rounded(self.value, self.interval)}{unit}"


def estimates(summary: Mapping[str, Any]) -> list[Estimate]:
    """The estimates from all samples; those of the best episode where there are no others."""
    chosen = summary["pooled"]["parameters"] if _pooled(summary) else summary["parameters"]
    return [_estimate(name, chosen[name], about) for name, about in summary["parameters"].items()]


def basis(summary: Mapping[str, Any]) -> str:
    """What the estimates are made from."""
    if not _pooled(summary):
        return f"The best episode (number {summary['best_episode'] + 1} of {summary['episodes']})"
    of = " of the first replicate" if summary["replicates"] > 1 else ""
    return f"All {summary['episodes'] * summary['steps']} samples{of}"


def sentences(summary: Mapping[str, Any]) -> list[str]:
    """Estimate, truth and verdict, one to four sentences."""
    found = estimates(summary)
    level = " (95 %)" if any(one.interval for one in found) else ""
    gives = "give" if _pooled(summary) else "gives"
    said = [f"{basis(summary)} {gives} {joined([str(one) for one in found])}{level}."]
    said += _truth(found)
    remarks = _LISTING.sub("", str(summary.get("verdict") or "")).strip()
    return [*said, remarks] if remarks else [*said, *_unidentified(found)]


def rounded(value: float, interval: Sequence[float | None] | None = None) -> str:
    """A number with its 95 % interval, to the digits that the interval leaves; else to four digits.

    ``0.6287 ± 0.0021``, or ``0.63 [0.61, 0.72]`` where the interval is lopsided.
    """
    low, high = interval or (None, None)
    if low is None or high is None or not (math.isfinite(low) and math.isfinite(high)):
        return f"{value:.4g}"
    below, above = value - low, high - value
    width = max(below, above, 0.0)
    if width == 0.0:
        return f"{value:.4g}"
    digits = max(0, 1 - math.floor(math.log10(width)))
    if min(below, above) > 0.75 * width:
        return f"{value:.{digits}f} ± {(below + above) / 2:.{digits}f}"
    return f"{value:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def result_rows(summary: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """The result as a table: titles, and rows of text.

    Parameters: truth, all samples, best episode; then the errors of the best episode. What was made from a
    file of samples has neither truth nor episodes.
    """
    rows = []
    for name, best in summary["parameters"].items():
        pooled = summary["pooled"]["parameters"].get(name, {})
        true = number(best.get("true"))
        rows.append([f"{name} [{best['unit']}]", true, _known(pooled), _known(best)])
    rows += [[label, "", "", number(summary.get(name))] for name, label in error_labels(summary).items()]
    if from_file(summary):
        return ["", "estimate"], [[label, told or error] for label, _, told, error in rows if told or error]
    return ["", "true", "all samples", f"best episode (number {summary['best_episode'] + 1})"], rows


def from_file(summary: Mapping[str, Any]) -> bool:
    """Whether it is an estimate from a file of samples, and not a run."""
    return "samples" in summary


def number(value: float | None) -> str:
    """Four significant digits; empty where nothing is known."""
    return "" if value is None else f"{value:.4g}"


def error_labels(summary: Mapping[str, Any]) -> dict[str, str]:
    """What the errors of the best episode are called, by their names in the summary."""
    units = {one["unit"] for one in summary["parameters"].values()}
    distance = "|estimate - true|" if len(units) <= 1 else "|estimate - true|, half-widths"
    return {
        "e_f": "fit error e_f",
        "e_cv": "cross-validation error e_cv",
        "e_total": "e_total = e_f + e_cv",
        "theta_error": distance,
        "field_rmse": "field error, rms",
    }


def joined(words: Sequence[str]) -> str:
    """``a, b and c``."""
    return f"{', '.join(words[:-1])} and {words[-1]}" if len(words) > 1 else "".join(words)


def _pooled(summary: Mapping[str, Any]) -> bool:
    values = [one.get("estimate") for one in summary.get("pooled", {}).get("parameters", {}).values()]
    return bool(values) and None not in values


def _known(one: Mapping[str, Any]) -> str:
    value = one.get("estimate")
    return "" if value is None else rounded(value, one.get("interval"))


def _estimate(name: str, one: Mapping[str, Any], about: Mapping[str, Any]) -> Estimate:
    ends, value = one.get("interval"), one["estimate"]
    known = ends is not None and None not in ends
    interval = (float(ends[0]), float(ends[1])) if known and ends is not None else None
    value = math.nan if value is None else value
    return Estimate(
        name, about["unit"], value, interval, about.get("true"), one.get("identified") is not False
    )


def _truth(found: Sequence[Estimate]) -> list[str]:
    """How the estimates compare with the truth, where that is known."""
    known = [one for one in found if one.true is not None]
    if not known:
        return []
    values = joined([f"{one.true:.4g}" for one in known])
    head = f"The true value is {values}" if len(known) == 1 else f"The true values are {values}"
    outside = [one.name for one in known if one.holds is False]
    if any(one.holds is None for one in known):
        return [f"{head}: {joined([_distance(one) for one in known])} away."]
    if outside:
        return [f"{head}; {joined(outside)} {'lie' if len(outside) > 1 else 'lies'} outside."]
    return [f"{head}, inside the interval{'s' if len(known) > 1 else ''}."]


def _distance(one: Estimate) -> str:
    return f"{abs(one.value - (one.true or 0.0)):.2g}"


def _unidentified(found: Sequence[Estimate]) -> list[str]:
    names = [one.name for one in found if not one.identified]
    return [f"These samples do not determine {joined(names)}."] if names else []
