"""Claims about what the trained vehicle does: they hold where it beats agents that learn nothing.

A vehicle that starts in the feature and is carried by the same water follows it without doing anything. So
each behaviour is measured for the learner, for an agent that acts at random, for one that only drifts and for
a lawnmower, in replicates paired by their noise; the learner must beat all three.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from pipelines import measures
from pipelines.experiments import Found, Settings
from pipelines.paper import companions, information, rules
from pipelines.paper.claim import Claim, counted
from pipelines.paper.companions import Setting
from pipelines.paper.rules import Finding

VISIBLE = 3.0  # a sample is in the feature where the field exceeds so many standard deviations of the noise

_Measure = Callable[[Found], NDArray[np.float64]]
_Part = Callable[[NDArray], NDArray]


def informative(settings: Settings, runs: Mapping[str, Found]) -> list[Claim]:
    """The paper's central claim."""
    tested: list[tuple[Setting, _Part]] = [(each, measures.late) for each in companions.advection(runs)]
    tested.append((companions.double_gyre(runs), lambda values: values))
    hypotheses = {each.name: _informative(each, part) for each, part in tested}
    return [
        Claim(
            name="Informative samples",
            where="contribution 2, section 6",
            text="the trained agent takes informative samples that help to estimate the field",
            hypotheses=hypotheses,
            why=(
                "Eq. 19 pays for a small e_total, which is mostly noise and hardly depends on how well the "
                "parameters can be known; what it does not pay for is not learned. Bound: the Cramer-Rao "
                "bound of the samples; both it and the error are in half-widths of the parameters' bounds, "
                "medians over late episodes (double gyre: over all)."
            ),
            replicates=", ".join(counted(each.learner) for each, _ in tested[1:]),
        )
    ]


def paths(settings: Settings, runs: Mapping[str, Found]) -> list[Claim]:
    """Good paths follow the feature and cross its level sets."""
    tested = companions.advection(runs)
    amplitude: float = tested[0].learner.mission.water.initial.amplitude  # type: ignore[attr-defined]

    def followed(run: Found) -> NDArray[np.float64]:
        return measures.late(measures.followed(information.field_along(run))).mean(axis=1)

    def crossed(run: Found) -> NDArray[np.float64]:
        return measures.late(measures.crossed(information.field_along(run), amplitude)).mean(axis=1)

    return [
        Claim(
            name="Paths of the trained agent",
            where="figures 4A-C",
            text="optimal paths follow the feature and cross its level sets",
            hypotheses={
                each.name: _beaten("field along the path", each, followed, 1)
                + _beaten("level sets crossed", each, crossed, 1)
                for each in tested
            },
            why=(
                "The water carries vehicle and feature alike, so drifting follows it best, and crosses "
                "nothing. Counted on the true field at the true positions, where noise adds no crossings; "
                "level sets are a tenth of the feature's height apart."
            ),
            replicates=counted(tested[0].learner),
        ),
        Claim(
            name="Paths of accurate episodes",
            where="figures 4A-C",
            text="the paths from which b is known well follow the feature and cross its level sets",
            hypotheses={each.name: _accurate(each.learner, amplitude) for each in tested},
            why=(
                "A sample tells of b where the feature is steep. This is so for every agent's paths: it says "
                "what a good path is, not that one was learned."
            ),
            replicates=counted(tested[0].learner),
        ),
    ]


def following(settings: Settings, runs: Mapping[str, Found]) -> list[Claim]:
    """The vehicle follows the feature under the double gyre."""
    setting = companions.double_gyre(runs)

    def within(run: Found) -> NDArray[np.float64]:
        visible = information.field_along(run) > VISIBLE * run.record.attrs["noise"]
        return visible.mean(axis=(1, 2))

    return [
        Claim(
            name="Following under the gyres",
            where="figure 6",
            text="the vehicle follows the feature",
            hypotheses={"": _beaten("samples where the field exceeds 3 sigma", setting, within, 1)},
            why="It starts within the feature, and the same water carries both.",
            replicates=counted(setting.learner),
        )
    ]


def _informative(setting: Setting, part: _Part) -> list[Finding]:
    """The learner's samples and estimates beside the others', and beside its own before training."""

    def bound(run: Found) -> NDArray[np.float64]:
        return np.median(part(information.bounds(run)), axis=1)

    def error(run: Found) -> NDArray[np.float64]:
        return np.median(part(information.errors(run.record, run.mission)), axis=1)

    every = information.bounds(setting.learner)
    first, last = (np.median(of(every), axis=1) for of in (measures.early, measures.late))
    return [
        *_beaten("bound", setting, bound, -1),
        *_beaten("error", setting, error, -1),
        rules.change("bound, early → late episodes", first, last, -1),
    ]


def _beaten(label: str, setting: Setting, measure: _Measure, sign: int) -> list[Finding]:
    """Whether the learner has more (sign 1) or less (-1) of something than each agent that learns nothing."""
    ours = measure(setting.learner)
    return [
        rules.change(f"{label}, {text} → learner", measure(run), ours, sign)
        for text, run in setting.others.items()
    ]


def _accurate(run: Found, amplitude: float) -> list[Finding]:
    """Least against most accurate tenth of the episodes."""
    field = information.field_along(run)
    found = []
    for label, values in (
        ("field along the path", measures.followed(field)),
        ("level sets crossed", measures.crossed(field, amplitude)),
    ):
        worst, best = measures.by_accuracy(run.record, values)
        found.append(rules.change(f"{label}, least → most accurate tenth", worst, best, 1))
    return found
