"""The tables of a calibration: title, columns and rows of text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from pipelines.calibration import evidence
from pipelines.calibration.cases import LEVELS
from pipelines.calibration.evidence import Rows, Share
from pipelines.calibration.missions import AGENTS, SIZES
from pipelines.calibration.needed import WIDTHS
from pipelines.calibration.selection import EPISODES, HOW, STEPS
from pipelines.calibration.wrong import WRONG

Judged = Mapping[tuple[str, str], Rows]
"""Rows by experiment and agent; runs of many episodes have the agent ""."""


class Table(NamedTuple):
    """A table; the first column is text."""

    name: str
    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]


def tables(judged: Judged) -> list[Table]:
    """All of them, in the order of docs/uncertainty.md."""
    return [
        _coverage(judged), _agents(judged), _luck(judged), _ranks(judged), _efficiency(judged),
        _unknown(judged), _field(judged), _alarms(judged), _power(judged), _selection(judged),
        _needed(judged),
    ]  # fmt: skip


def experiments(judged: Judged) -> list[str]:
    """Those that there are missions of."""
    return [experiment for experiment in WRONG if of(judged, experiment)]


def of(judged: Judged, experiment: str) -> Rows:
    """The rows of all agents."""
    return [row for agent in AGENTS for row in judged.get((experiment, agent), ())]


def percent(found: Share) -> str:
    """The mean over the unknowns; a star where one of them is outside its band."""
    return f"{100 * found.mean:.1f}{'' if found.inside else ' *'}"


def _coverage(judged: Judged) -> Table:
    columns = ("", "n", "missions", *(f"{what} {100 * level:.0f} %" for what in ("interval", "region")
                                      for level in LEVELS))  # fmt: skip
    rows = []
    for experiment in experiments(judged):
        for title, chosen in ((experiment, list), (f"{experiment}, informative paths", evidence.informative)):
            for n in SIZES:
                some = chosen(evidence.of_size(of(judged, experiment), n))
                if some:
                    cells = [
                        percent(each)
                        for what in ("covered", "region")
                        for each in evidence.coverage(some, what)
                    ]
                    rows.append((title, str(n), str(len(some)), *cells))
    return Table("coverage", "Coverage of intervals and joint regions [%]", columns, rows)


def _agents(judged: Judged) -> Table:
    rows = []
    for experiment in experiments(judged):
        for agent in AGENTS:
            some = judged.get((experiment, agent), ())
            if not some:
                continue
            cells = [percent(evidence.coverage(evidence.of_size(some, n), "covered")[-1]) for n in SIZES]
            rows.append((f"{experiment}, {agent}", *cells))
    return Table(
        "agents", "Coverage of the intervals of 95 %, by agent [%]", ("", *(f"n = {n}" for n in SIZES)), rows
    )


def _luck(judged: Judged) -> Table:
    rows = []
    for experiment in experiments(judged):
        for agent in AGENTS:
            some = judged.get((experiment, agent), ())
            if not some:
                continue
            each = [evidence.of_size(some, n) for n in SIZES]
            straight = [percent(evidence.coverage(part, "straight")[-1]) for part in each]
            rows.append((f"{experiment}, {agent}, straight", *straight))
            less = [percent(evidence.against_straight(part)[-1]) for part in each]
            rows.append((f"{experiment}, {agent}, less luck", *less))
    title = "The same where the model is straight, with the same noise; and without the luck of the noise [%]"
    return Table("luck", title, ("", *(f"n = {n}" for n in SIZES)), rows)


def _field(judged: Judged) -> Table:
    rows = []
    for experiment in experiments(judged):
        for title, chosen in ((experiment, list), (f"{experiment}, informative paths", evidence.informative)):
            found = evidence.band(chosen(of(judged, experiment)))
            if found:
                span = f"{100 * found.low:.1f} to {100 * found.high:.1f}"
                rows.append((title, str(found.count), f"{100 * found.held:.1f}", span, f"{found.ratio:.2f}"))
    columns = ("", "missions", "true field in the band [%]", "95 % band", "error / told, median")
    return Table("field", f"The field's pointwise band of 95 %, n = {SIZES[-1]}", columns, rows)


def _needed(judged: Judged) -> Table:
    columns, rows = ("agent", "width", "missions", "samples, median", "stopped [%]", "intervals hold [%]"), []
    for agent in AGENTS:
        some = judged.get(("advection", f"needed {agent}"), ())
        for width in WIDTHS if some else ():
            found = evidence.needed(some, width)
            median = f"{found.median:.0f}" if found.median < float("inf") else f"more than {SIZES[-1]}"
            held = percent(found.held) if found.held.count else ""
            rows.append((agent, f"{width:g}", str(len(some)), median, f"{100 * found.stopped:.0f}", held))
    return Table("needed", "Samples until every interval of 95 % is narrower", columns, rows)


def _ranks(judged: Judged) -> Table:
    rows = []
    for experiment in experiments(judged):
        for n in SIZES:
            some = evidence.of_size(of(judged, experiment), n)
            telling = evidence.informative(some)
            p = [f"{evidence.uniform(part):.2g}" if part else "" for part in (some, telling)]
            rows.append((experiment, str(n), *p))
    title = "Ranks of the truth: probability of ranks so far from uniform"
    return Table("ranks", title, ("", "n", "all missions", "informative paths"), rows)


def _efficiency(judged: Judged) -> Table:
    columns = (
        "",
        "n",
        "paths",
        "RMSE / CR",
        "95 % band",
        "grossly off [%]",
        "truth in region [%]",
        "the others'",
        "not the best fit",
    )
    rows = []
    for experiment in experiments(judged):
        for title, chosen in ((experiment, evidence.informative), (f"{experiment}, normal", evidence.normal)):
            for n in SIZES:
                some = evidence.of_size(of(judged, experiment), n)
                telling = chosen(some)
                if telling:
                    rows.append((title, str(n), f"{len(telling)} of {len(some)}", *_errors(telling)))
    return Table("efficiency", "Errors on informative paths, in Cramer-Rao's bounds", columns, rows)


def _errors(rows: Rows) -> tuple[str, ...]:
    found = evidence.efficiency(rows)
    band = f"{found.low:.2f} to {found.high:.2f}"
    gross = f"{100 * found.gross:.1f}", f"{100 * found.held:.0f}" if found.gross else ""
    return f"{found.ratio:.2f}", band, *gross, f"{found.rest:.2f}", str(found.surpassed)


def _unknown(judged: Judged) -> Table:
    rows = []
    for experiment in experiments(judged):
        each = [evidence.of_size(of(judged, experiment), n) for n in SIZES]
        cells = [percent(evidence.share((row["unknown covered"] for row in some), 0.95)) for some in each]
        rows.append((experiment, *cells))
    title = "Coverage of the intervals of 95 % where the noise is estimated [%]"
    return Table("unknown", title, ("", *(f"n = {n}" for n in SIZES)), rows)


def _alarms(judged: Judged) -> Table:
    rows = []
    for experiment in experiments(judged):
        for what, text in (("p", "noise known"), ("unknown p", "noise estimated")):
            each = [evidence.of_size(of(judged, experiment), n) for n in SIZES]
            cells = [f"{100 * evidence.false_alarms(some, what).mean:.1f}" for some in each]
            rows.append((f"{experiment}, {text}", *cells))
    title = "False alarms: right models that are called wrong [%]"
    return Table("alarms", title, ("", *(f"n = {n}" for n in SIZES)), rows)


def _power(judged: Judged) -> Table:
    columns = ("", "missions", "called wrong [%]", "size from which 90 % are", "missions so large [%]")
    rows = []
    for experiment in experiments(judged):
        for name in WRONG[experiment]:
            found = evidence.power(of(judged, experiment), name)
            rows.append(
                (
                    f"{experiment}, {name}",
                    str(found.count),
                    f"{100 * found.told:.1f}",
                    f"{found.size:.2f}",
                    f"{100 * found.large:.0f}",
                )
            )
    return Table("power", f"Wrong models, n = {SIZES[-1]}", columns, rows)


def _selection(judged: Judged) -> Table:
    some, rows = judged["advection", ""], []
    for name in ("first", "best", "pooled"):
        each = [[row[key] for row in some if key in row] for key in (f"{name}, {how}" for how in HOW)]
        rows.append((name, *(percent(evidence.share(hits, 0.95)) if hits else "" for hits in each)))
    title = f"Coverage of intervals of 95 % in {len(some)} runs of {EPISODES} episodes of {STEPS} samples [%]"
    return Table("selection", title, ("estimate", *HOW), rows)
