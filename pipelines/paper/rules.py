"""The rules by which a claim is judged: from numbers alone, the same rules for all claims.

A claim rests on findings. Each is tested twice: whether it is so, and whether it is not so; chance must be
excluded in either case, after Holm's correction over all findings. What is neither is underpowered, and the
smallest effect that would have been seen is told. The rules' text stands on the page.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import binomtest, percentileofscore

from pipelines.paper import evidence
from pipelines.report import spread

SIGNIFICANT = 0.05  # for all findings together
NEAR = 0.10  # relative distance within which two values are the same
RELEVANT = 0.05  # a relative change smaller than this is none
LUCKY = 0.05  # a value that fewer replicates reach is luck
_FEWEST = 2  # replicates that a test needs

RULES = {
    "change": (
        "A change between two settings, in replicates paired by their noise, is confirmed when more of them "
        "have its sign than chance allows and the median change is at least 5 % of the median that it starts "
        "from; refuted when the median change is less than these 5 %, or of the other sign."
    ),
    "same": (
        "Two settings give the same when the median of the paired difference lies within 10 %; they do not "
        "when it lies beyond."
    ),
    "value": "A value is confirmed when the median lies within 10 % of it, refuted when it lies beyond.",
    "small": "A size is confirmed when the median is below the bound that is named, refuted when above.",
    "reached": (
        "An accuracy printed for one run is confirmed when more than 5 % of the replicates reach it, refuted "
        "when fewer do; its percentile among ours is told."
    ),
    "fact": "A number with no chance in it is compared as it is.",
    "unsaid": "What the paper gives no number for, or no spread, cannot be judged.",
}


class Outcome(Enum):
    """What a rule says of a finding."""

    YES = "confirmed"
    NO = "refuted"
    OPEN = "underpowered"
    UNSAID = "not said"


class Verdict(Enum):
    """What the findings say of a claim."""

    REPRODUCED = "reproduced"
    NOT = "not reproduced"
    OPEN = "underpowered"
    UNSAID = "the paper does not say enough"


@dataclass(frozen=True)
class Finding:
    """What was measured, and the tests of it.

    Args:
        label: which measurement.
        measured: the numbers, for a reader.
        rule: a key of ``RULES``.
        so: p of the test that it is as claimed.
        not_so: p of the test that it is not.
        relevant: whether the effect that was found is large enough to matter.
        smallest: of a level, the smallest effect that would have been seen.
        numbers: effect, interval and the like, for the JSON.
    """

    label: str
    measured: str
    rule: str
    so: float = 1.0
    not_so: float = 1.0
    relevant: bool = True
    smallest: Callable[[float], float] | None = None
    numbers: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Judged:
    """A finding with its outcome among all findings.

    Args:
        finding: what was measured.
        outcome: by its rule.
        so: adjusted p that it is as claimed.
        not_so: adjusted p that it is not.
        smallest: effect that would have been seen, where the outcome is open.
    """

    finding: Finding
    outcome: Outcome
    so: float
    not_so: float
    smallest: float | None = None

    @property
    def measured(self) -> str:
        """The numbers for a reader, with what would have been seen where the outcome is open."""
        if self.smallest is None:
            return self.finding.measured
        if not np.isfinite(self.smallest):
            return f"{self.finding.measured}; too few replicates"
        if self.finding.rule == "reached":
            return f"{self.finding.measured}; smallest share to be seen: {100 * self.smallest:.0f} %"
        sign = "±" if self.finding.rule in ("same", "value") else ""
        return f"{self.finding.measured}; smallest to be seen: {sign}{self.smallest:.2g}"


def judge(findings: Sequence[Finding]) -> list[Judged]:
    """Every finding's outcome; each kind of error, a false yes and a false no, is held to 5 % over all."""
    tested = [each for each in findings if each.rule not in ("fact", "unsaid")]
    strictest = SIGNIFICANT / max(1, len(tested))
    so = dict(zip(map(id, tested), evidence.holm([each.so for each in tested]), strict=True))
    not_so = dict(zip(map(id, tested), evidence.holm([each.not_so for each in tested]), strict=True))
    judged = []
    for each in findings:
        p = float(so.get(id(each), each.so)), float(not_so.get(id(each), each.not_so))
        outcome = _outcome(each, *p)
        seen = each.smallest(strictest) if outcome is Outcome.OPEN and each.smallest is not None else None
        judged.append(Judged(each, outcome, *p, seen))
    return judged


def verdict(outcomes: Sequence[Outcome]) -> Verdict:
    """Any refuted: not reproduced. All confirmed: reproduced. Else what is missing: word or power."""
    if Outcome.NO in outcomes:
        return Verdict.NOT
    if all(outcome is Outcome.YES for outcome in outcomes):
        return Verdict.REPRODUCED
    return Verdict.UNSAID if Outcome.UNSAID in outcomes else Verdict.OPEN


def change(label: str, first: ArrayLike, last: ArrayLike, sign: int) -> Finding:
    """Whether values change with ``sign`` from the one setting to the other, pair by pair."""
    if np.size(first) < _FEWEST:
        return Finding(label, "none to compare", "change", smallest=lambda level: np.inf)
    first, last = _enough(first), _enough(last)
    effects, scale = (last - first) * sign, abs(_median(first))
    least = RELEVANT * scale
    right = int(np.sum(effects > 0))
    measured = f"{_arrow(first, last)}, {_effect(last - first)}, {right} of {first.size}"
    return Finding(
        label, measured, "change", evidence.above(effects, 0.0), evidence.below(effects, least),
        _median(effects) >= least, lambda level: max(least, evidence.smallest_effect(effects, level)),
        _numbers(last - first) | {"share": right / max(1, first.size)},
    )  # fmt: skip


def same(label: str, first: ArrayLike, last: ArrayLike) -> Finding:
    """Whether two settings give similar values, pair by pair."""
    first, last = _enough(first), _enough(last)
    tests = _within(last - first, NEAR * abs(_median(first)))
    measured = f"{_arrow(first, last)}, {_effect(last - first)}"
    return Finding(label, measured, "same", *tests, numbers=_numbers(last - first))


def value(label: str, values: ArrayLike, claimed: float) -> Finding:
    """Whether the median of ``values`` is close to what is claimed."""
    values = _enough(values)
    tests = _within(values - claimed, NEAR * abs(claimed))
    return Finding(label, f"{spread(values)} for {claimed:g}", "value", *tests, numbers=_numbers(values))


def small(label: str, values: ArrayLike, bound: float, what: str) -> Finding:
    """Whether the median of ``values`` is below a bound, which ``what`` names."""
    values = _enough(values)
    tests = evidence.below(values, bound), evidence.above(values, bound)
    smallest = lambda level: evidence.smallest_effect(bound - values, level)  # noqa: E731
    measured = f"{spread(values)}, {what}: {bound:g}"
    return Finding(label, measured, "small", *tests, True, smallest, _numbers(values))


def reached(label: str, errors: ArrayLike, claimed: float, others: ArrayLike | None = None) -> Finding:
    """Whether errors as small as the one claimed are no luck; ``others`` are errors to compare with."""
    errors = _enough(errors)
    count, n = int(np.sum(errors <= claimed)), errors.size
    tests = (
        float(binomtest(count, n, LUCKY, alternative="greater").pvalue),
        float(binomtest(count, n, LUCKY, alternative="less").pvalue),
    )
    share = percentileofscore(errors, claimed)
    measured = f"{spread(errors)}; the paper's {claimed:.2g} is at percentile {share:.0f} of ours"
    if others is not None:
        measured += f", {percentileofscore(np.asarray(others), claimed):.0f} of a random agent's"
    numbers = _numbers(errors) | {"percentile": float(share)}
    return Finding(
        label,
        measured,
        "reached",
        *tests,
        True,
        lambda level: evidence.smallest_share(n, LUCKY, level),
        numbers,
    )


def fact(label: str, measured: str, holds: bool) -> Finding:
    """Whether something holds that has no chance in it."""
    return Finding(label, measured, "fact", so=0.0 if holds else 1.0, not_so=1.0 if holds else 0.0)


def unsaid(label: str, measured: str) -> Finding:
    """What the paper says nothing of to compare with."""
    return Finding(label, measured, "unsaid")


def _outcome(finding: Finding, so: float, not_so: float) -> Outcome:
    if finding.rule == "unsaid":
        return Outcome.UNSAID
    if not_so <= SIGNIFICANT:
        return Outcome.NO
    return Outcome.YES if so <= SIGNIFICANT and finding.relevant else Outcome.OPEN


def _within(differences: NDArray, margin: float) -> tuple[float, float, bool, Callable[[float], float]]:
    """Two one-sided tests that the median lies within the margin round 0, one that it lies beyond."""
    inside = max(evidence.above(differences, -margin), evidence.below(differences, margin))
    beyond = min(1.0, 2 * min(evidence.below(differences, -margin), evidence.above(differences, margin)))
    return inside, beyond, True, lambda level: evidence.smallest_margin(differences, level)


def _enough(values: ArrayLike) -> NDArray[np.float64]:
    """Values of replicates, (n,); ValueError where they are too few or not finite."""
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or values.size < _FEWEST or not np.isfinite(values).all():
        raise ValueError(
            f"a finding needs one finite number of each of {_FEWEST} replicates or more: {values}"
        )
    return values


def _median(values: NDArray) -> float:
    return float(np.median(values))


def _numbers(values: NDArray) -> dict[str, float]:
    low, high = evidence.interval(values)
    return {"median": _median(values), "low": low, "high": high, "replicates": values.size}


def _effect(change: NDArray) -> str:
    low, high = evidence.interval(change)
    return f"{_median(change):+.2g} [{low:+.2g}, {high:+.2g}]"


def _arrow(first: NDArray, last: NDArray) -> str:
    return f"{_median(first):.3g} → {_median(last):.3g}"
