"""The rules by which a claim is judged: from numbers alone, the same rules for all claims.

A claim rests on one or more findings; each says yes, partly, no or unclear by one of the rules below, whose
text stands on the page. The verdict follows from all findings of a claim (``verdict``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import binomtest, mannwhitneyu

SIGNIFICANT = 0.05  # of every test
NEAR, ROUGHLY = 0.10, 0.25  # relative distance of a value that is close, and of one that is still comparable
NEGLIGIBLE = 0.05  # a relative change smaller than this is none
SIMILAR = 0.01  # rms difference of two fields that are similar, as a share of the peak
FEWEST = 5  # episodes that a comparison of episodes needs on each side

RULES = {
    "value": "A value is confirmed when the median over replicates is within 10 % of it, partly within 25 %.",
    "accuracy": "An accuracy is confirmed when at least half of the replicates reach it, partly when any do.",
    "trend": (
        "A trend is confirmed when replicates, paired by their noise, have its sign (sign test, p <= 0.05) "
        "and the median change is at least 5 %; it is refuted by the opposite sign, or by quartiles of the "
        "change within 5 % of nothing; else it is unclear."
    ),
    "sameness": (
        "Two settings give similar results when the quartiles of their paired difference lie within 10 %; "
        "they do not when the difference has one sign (sign test, p <= 0.05); else it is unclear."
    ),
    "episodes": (
        "Two kinds of episodes are compared by a one-sided Mann-Whitney test (p <= 0.05) either way; with "
        "fewer than 5 episodes of a kind it is unclear."
    ),
    "chance": (
        "Whether a late episode is the best one is unclear unless the best episodes of the replicates "
        "favour one half of the run (binomial test, p <= 0.05)."
    ),
    "field": "Fields are similar when half of the replicates differ by at most 1 % of the peak (rms).",
    "growth": "A size grows when it is at least 10 % larger at the end.",
    "share": "At least 80 % is confirmed, at least half partly.",
    "definition": "A number that follows from the definition is confirmed when it is equal to two digits.",
    "unsaid": "What the paper gives no number for cannot be told.",
}


class Outcome(Enum):
    """What a rule says of a finding."""

    YES = "yes"
    PARTLY = "partly"
    NO = "no"
    UNCLEAR = "unclear"


class Verdict(Enum):
    """What the findings say of a claim."""

    REPRODUCED = "reproduced"
    PARTLY = "partly"
    NOT = "not reproduced"
    UNKNOWN = "cannot be told"


@dataclass(frozen=True)
class Finding:
    """What was measured, and what a rule makes of it.

    Args:
        label: which measurement.
        measured: the numbers, for a reader.
        outcome: by the rule.
        rule: a key of ``RULES``.
    """

    label: str
    measured: str
    outcome: Outcome
    rule: str


def verdict(outcomes: Sequence[Outcome]) -> Verdict:
    """All yes: reproduced. Any yes or partly: partly. All no: not. Else it cannot be told."""
    if all(outcome is Outcome.YES for outcome in outcomes):
        return Verdict.REPRODUCED
    if any(outcome in (Outcome.YES, Outcome.PARTLY) for outcome in outcomes):
        return Verdict.PARTLY
    if all(outcome is Outcome.NO for outcome in outcomes):
        return Verdict.NOT
    return Verdict.UNKNOWN


def value(values: ArrayLike, claimed: float) -> Outcome:
    """Whether the median of ``values`` is close to what is claimed."""
    distance = abs(float(np.median(np.asarray(values))) / claimed - 1.0)
    return Outcome.YES if distance <= NEAR else Outcome.PARTLY if distance <= ROUGHLY else Outcome.NO


def accuracy(errors: ArrayLike, claimed: float) -> Outcome:
    """Whether ``errors`` are as small as the one claimed."""
    share = float(np.mean(np.asarray(errors) <= claimed))
    return Outcome.YES if share >= 0.5 else Outcome.PARTLY if share > 0 else Outcome.NO


def trend(low: ArrayLike, high: ArrayLike, sign: int) -> Outcome:
    """Whether values change with ``sign`` from the one setting to the other, pair by pair."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    change, scale = high - low, abs(float(np.median(low)))
    middle = float(np.median(change))
    if _one_sign(change * sign) and middle * sign >= NEGLIGIBLE * scale:
        return Outcome.YES
    if _one_sign(-change * sign) or _within(change, NEGLIGIBLE * scale):
        return Outcome.NO
    return Outcome.UNCLEAR


def sameness(low: ArrayLike, high: ArrayLike) -> Outcome:
    """Whether two settings give similar values, pair by pair."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    change = high - low
    if _within(change, NEAR * abs(float(np.median(low)))):
        return Outcome.YES
    return Outcome.NO if _one_sign(change) or _one_sign(-change) else Outcome.UNCLEAR


def episodes(lower: ArrayLike, higher: ArrayLike) -> Outcome:
    """Whether the values of one kind of episodes are lower than those of another."""
    lower, higher = np.ravel(lower), np.ravel(higher)
    if min(lower.size, higher.size) < FEWEST:
        return Outcome.UNCLEAR
    if mannwhitneyu(lower, higher, alternative="less").pvalue <= SIGNIFICANT:
        return Outcome.YES
    return (
        Outcome.NO
        if mannwhitneyu(lower, higher, alternative="greater").pvalue <= SIGNIFICANT
        else Outcome.UNCLEAR
    )


def chance(best: ArrayLike, count: int, claimed: int) -> Outcome:
    """Whether the best of ``count`` episodes tends to lie in the half of the run where the claimed one does.

    Args:
        best: numbers of the best episodes, counted from 1.
        count: episodes of a run.
        claimed: number of the paper's best episode.
    """
    best = np.asarray(best)
    late = int(np.sum(best > count / 2))
    if binomtest(late, best.size).pvalue > SIGNIFICANT:
        return Outcome.UNCLEAR
    return Outcome.YES if (late > best.size / 2) == (claimed > count / 2) else Outcome.NO


def share(values: ArrayLike) -> Outcome:
    """Whether the median share is at least 80 %, or half."""
    middle = float(np.median(np.asarray(values)))
    return Outcome.YES if middle >= 0.8 else Outcome.PARTLY if middle >= 0.5 else Outcome.NO


def definition(found: float, claimed: float) -> Outcome:
    """Whether two numbers agree to two digits."""
    return Outcome.YES if f"{found:.2g}" == f"{claimed:.2g}" else Outcome.NO


def _one_sign(change: np.ndarray) -> bool:
    """Whether more of the changes are positive than chance allows."""
    return bool(binomtest(int(np.sum(change > 0)), change.size, alternative="greater").pvalue <= SIGNIFICANT)


def _within(change: np.ndarray, reach: float) -> bool:
    """Whether both quartiles lie within ``reach`` of zero."""
    return float(np.abs(np.percentile(change, [25, 75])).max()) <= reach
