"""The trends of figure 3 as the text describes them, and how far a setting shows them.

Each trend rests on comparisons that ``rules`` judges, the same as in the claims about figure 3. A search
needs a number: the margin of a comparison is its effect as a share of the least that counts (a change of
5 %), or what is left of the greatest difference that does not count (10 %), at most 1 either way. A trend's
margin is the least of its comparisons'; the score of a setting is the mean over its trends, -1 to 1. A trend
*seems* to hold where every effect is large enough, whatever chance says.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines import measures
from pipelines.paper import rules
from pipelines.paper.rules import NEAR, RELEVANT, Finding

USUAL = "usual"
VARIATIONS: dict[str, tuple[str, ...]] = {
    USUAL: (),
    "alpha 0.1": ("agent.step_size=0.1",),
    "lambda 0.1": ("agent.trace_decay=0.1",),
    "epsilon 0.05": ("agent.exploration=0.05",),
    "epsilon 0.3": ("agent.exploration=0.3",),
}
"""The extremes of what figure 3 varies; usual are 0.9, 0.9 and 0.15."""

TRENDS = (
    "return rises", "error falls", "small alpha better", "large lambda better", "flat in epsilon",
    "error ends near 2",
)  # fmt: skip
"""Their names, in order."""

EXPECTED = 2.0
"""e_total of the noise alone."""

Curves = Mapping[str, NDArray[np.float64]]
"""By variation: return and e_total of every episode, (2, replicates, episodes)."""


class Comparison(NamedTuple):
    """Two settings, or early and late episodes, of every replicate.

    Args:
        label: what is compared.
        sign: of the change from ``first`` to ``last`` that is claimed; 0: they are the same.
        first: (r,).
        last: (r,).
    """

    label: str
    sign: int
    first: NDArray[np.float64]
    last: NDArray[np.float64]

    def finding(self) -> Finding:
        """What the rules are told."""
        if self.sign:
            return rules.change(self.label, self.first, self.last, self.sign)
        return rules.same(self.label, self.first, self.last)

    def margin(self) -> float:
        """How far it is as claimed, -1 to 1: see above."""
        scale, effect = abs(np.median(self.first)), np.median(self.last - self.first)
        share = self.sign * effect / (RELEVANT * scale) if self.sign else 1 - abs(effect) / (NEAR * scale)
        return float(np.clip(share, -1.0, 1.0))

    def seems(self) -> bool:
        """Whether the effect is large enough or, of what is the same, small enough."""
        return self.margin() >= (1.0 if self.sign else 0.0)


def trends(curves: Curves) -> dict[str, list[Comparison]]:
    """The comparisons that each trend rests on."""
    returned, error = {}, {}
    for name, each in curves.items():
        returned[name], error[name] = (measures.late(values).mean(axis=1) for values in each)
    slow, low, high = "alpha 0.1", "epsilon 0.05", "epsilon 0.3"
    early_return, early_error = (measures.early(values).mean(axis=1) for values in curves[slow])
    expected = np.full(error[USUAL].shape, EXPECTED)
    return {
        "return rises": [Comparison("return, early → late", 1, early_return, returned[slow])],
        "error falls": [Comparison("e_total, early → late", -1, early_error, error[slow])],
        "small alpha better": [
            Comparison("return, alpha 0.9 → 0.1", 1, returned[USUAL], returned[slow]),
            Comparison("e_total, alpha 0.9 → 0.1", -1, error[USUAL], error[slow]),
        ],
        "large lambda better": [
            Comparison("return, lambda 0.1 → 0.9", 1, returned["lambda 0.1"], returned[USUAL]),
            Comparison("e_total, lambda 0.1 → 0.9", -1, error["lambda 0.1"], error[USUAL]),
        ],
        "flat in epsilon": [
            Comparison("return, epsilon 0.05 → 0.3", 0, returned[low], returned[high]),
            Comparison("e_total, epsilon 0.05 → 0.3", 0, error[low], error[high]),
        ],
        "error ends near 2": [Comparison("2 → e_total", 0, expected, error[USUAL])],
    }


def score(curves: Curves) -> float:
    """Mean margin of the trends, -1 to 1."""
    return float(np.mean([min(each.margin() for each in found) for found in trends(curves).values()]))


def seeming(curves: Curves) -> dict[str, bool]:
    """Which trends seem to hold."""
    return {name: all(each.seems() for each in found) for name, found in trends(curves).items()}
