"""The tables of the diagnosis: title, columns and rows of text. All findings are judged together."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines import measures, report
from pipelines.diagnosis import learners, returns
from pipelines.diagnosis.cases import CONTROLS, FREE, PAPER, SETTINGS
from pipelines.diagnosis.distance import Distance
from pipelines.diagnosis.measured import Measured
from pipelines.paper import evidence, rules
from pipelines.paper.rules import Finding

_MARKS = {
    rules.Outcome.YES: "yes",
    rules.Outcome.NO: "no",
    rules.Outcome.OPEN: "open",
    rules.Outcome.UNSAID: "",
}
_SETTING = {"limited": "as shipped", "free": "heading free", "from 200": "values from 200"}


class Table(NamedTuple):
    """A table."""

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]


_Rows = list[tuple[tuple[str, ...], list[Finding]]]
_Judging = tuple[Table, _Rows]
"""A table without rows, and for each row its texts and findings."""


def tables(found: Measured) -> list[Table]:
    """All of them; a row that has findings ends with their outcomes."""
    made = [_controls(found), _chain(found), _eq19(found, "return", 1), _eq19(found, "e_total", -1)]
    judged = iter(rules.judge([each for _, rows in made for _, findings in rows for each in findings]))
    told = [
        Table(
            table.title,
            table.columns,
            [(*texts, *_told(next(judged) for _ in findings)) for texts, findings in rows],
        )
        for table, rows in made
    ]
    return [*told, _values(found), _variance(found), _best(found), _coverage(found)]


def _told(judged: Iterable[rules.Judged]) -> list[str]:
    return [text for each in judged for text in (each.finding.measured, _MARKS[each.outcome])]


def _controls(found: Measured) -> _Judging:
    """Whether a learner that is paid for it comes nearer to the feature than a random agent."""
    rows = []
    for name, case in CONTROLS.items():
        random = found.parts["free" if FREE in case.overrides else "limited", "random"]["distance"].values
        run = found.parts[name, "learner"]
        finding = rules.change(name, late(random), late(run["distance"].values), -1)
        agree = f"{learners.agreement(run['value'].values):.2f}"
        rows.append(((name, signal(case.reward, random, found.noise), agree), [finding]))
    columns = ("paid", "f", "values agree", "late distance, random → learner [length]", "learns")
    return Table("Controls: paid for being near the feature", columns, []), rows


def signal(reward: object, distances: NDArray[np.float64], noise: float) -> str:
    """f of a control: how far the paths of a random agent differ in return, in deviations of the noise."""
    if not isinstance(reward, Distance) or not reward.noisy:
        return "no noise"
    return f"{reward.size / 100 * distances.std() / noise:.2f}"


def _chain(found: Measured) -> _Judging:
    rows = [
        ((name,), [rules.change(name, random, learner, 1)]) for name, (learner, random) in found.chain.items()
    ]
    return Table(
        "Control: ten states in a row", ("paid at the end", "late end, random → learner", "learns"), []
    ), rows


def _eq19(found: Measured, quantity: str, sign: int) -> _Judging:
    """What the paper's reward leads to: learner beside random agent, and early beside late episodes."""
    rows = []
    for estimator in PAPER:
        for setting in SETTINGS:
            beside = "free" if setting == "free" else "limited"
            runs = found.runs[estimator, beside, "random"], found.runs[estimator, setting, "learner"]
            random, learner = (measures.final(run.record, quantity) for run in runs)
            findings = [
                rules.change("", late(random), late(learner), sign),
                rules.change("", early(learner), late(learner), sign),
            ]
            rows.append(((f"{estimator}, {_SETTING[setting]}",), findings))
    columns = ("", f"late {quantity}, random → learner", "better", f"{quantity}, early → late", "better")
    return Table(f"The paper's reward: {quantity}", columns, []), rows


def _values(found: Measured) -> Table:
    """Whether two replicates learn the same value function."""
    names = (next(iter(CONTROLS)), *PAPER)
    rows = [
        (name, f"{learners.agreement(found.parts[name, 'learner']['value'].values):.2f}") for name in names
    ]
    return Table("Value functions of two replicates", ("paid", "correlation, median"), rows)


def _variance(found: Measured) -> Table:
    """Whether a path can be told from another by its return."""
    rows = []
    for (estimator, agent), values in found.layouts.items():
        split, (low, high) = returns.parts(values), returns.effect_interval(values)
        deviations = (f"{np.sqrt(each):.2g}" for each in (split.path, split.noise + split.both))
        effect = f"{split.effect:.2g} [{low:.2g}, {high:.2g}]"
        rows.append(
            (
                f"{estimator}, {agent}",
                *deviations,
                f"{100 * split.share:.1f} %",
                effect,
                f"{split.episodes:.0f}",
            )
        )
    columns = (
        "",
        "deviation by path",
        "by noise",
        "path's share",
        "f [95 %]",
        "episodes to tell it",
    )
    return Table("The return of fixed paths", columns, rows)


def _best(found: Measured) -> Table:
    """What could be won."""
    rows = []
    for (estimator, name), (end, before) in found.paths.items():
        total = end + before
        low, high = evidence.interval(total)
        rows.append(
            (
                f"{estimator}: {name}",
                _mean(total),
                f"{np.median(total):.1f} [{low:.1f}, {high:.1f}]",
                _mean(end),
                _mean(before),
            )
        )
    for (estimator, setting, agent), run in found.runs.items():
        if setting == "limited":
            values = measures.late(measures.final(run.record, "return"))
            end = measures.late(run.record["reward"].isel(step=-1).transpose("replicate", "episode").values)
            rows.append(
                (
                    f"{estimator}: late episodes, {agent}",
                    f"{values.mean():.1f}",
                    f"{np.median(values):.1f}",
                    f"{end.mean():.1f}",
                    f"{(values - end).mean():.1f}",
                )
            )
    columns = ("", "return, mean ± error", "median [95 %]", "at the last sample", "before it")
    return Table("What Eq. 19 pays", columns, sorted(rows))


def _mean(values: NDArray) -> str:
    return f"{values.mean():.1f} ± {values.std(ddof=1) / np.sqrt(values.size):.1f}"


def _coverage(found: Measured) -> Table:
    """How much is seen."""
    rows = [
        (f"{estimator}, {_SETTING[setting]}, {agent}", *(_percent(shares) for shares in each.values()))
        for (estimator, setting, agent), each in found.seen.items()
    ]
    columns = ("", "cells", "cells, 10 samples", "(tile, action)", "(tile, action), 10 times")
    return Table("Seen in a run, of what is in reach: median [quartiles]", columns, rows)


def _percent(shares: NDArray) -> str:
    return f"{report.spread(100 * shares, 2)} %"


def late(values: NDArray) -> NDArray[np.float64]:
    """Mean of the late episodes of each replicate, (r,)."""
    return measures.late(values).mean(axis=1)


def early(values: NDArray) -> NDArray[np.float64]:
    """Mean of the early episodes of each replicate, (r,)."""
    return measures.early(values).mean(axis=1)
