"""Several runs side by side on one page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median, quantiles
from typing import TYPE_CHECKING, Any

from fieldrl.runs import meaning, netcdf, run_page, title
from fieldrl.runs.inventory import Found

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fieldrl.runs.run_page import Picture

OBJECTIVE = "late_e_total"
"""What runs are put in order by: its median over the replicates."""

_PATHS = 12  # most runs whose paths are shown
_COMPARED = 4  # most runs whose learning curves fit one figure
_SEED = "seed"


@dataclass(frozen=True)
class Effect:
    """How the objective depends on one key.

    Args:
        key: what varies.
        rows: value, number of runs, median and quartiles of the objective, as text.
        picture: the same.
    """

    key: str
    rows: list[list[str]]
    picture: Picture


def page(runs: Sequence[Found], name: str, command: str, pictures: Sequence[Picture] = ()) -> str:
    """The report of finished runs.

    Args:
        runs: finished ones, at least one.
        name: above the page.
        command: that makes it again.
        pictures: to show besides, such as those of a sweep.

    Returns:
        HTML.
    """
    order = sorted(runs, key=_objective)
    keys = differing(order)
    return run_page.render(
        "comparison",
        name=name,
        said=_sentence(order),
        titles=[*(title.short(keys).values() if keys else ["run"]), *_numbers_titles(order)],
        rows=[[*(_values(one, keys) if keys else [one.title]), *_numbers(one)] for one in order],
        keys=len(keys) or 1,
        effects=[_effect(order, key) for key in keys if key != _SEED or len(keys) == 1],
        pictures=[*pictures, *_learning(order)],
        paths=[_path(one, _label(one, keys)) for one in order[:_PATHS] if _record(one) is not None],
        left_out=max(0, len(order) - _PATHS),
        runs={one.run.name: one.command for one in order},
        command=command,
    )


def differing(runs: Sequence[Found]) -> list[str]:
    """The keys in which runs differ, the experiment first."""
    each = [_changes(one) for one in runs]
    keys = dict.fromkeys(key for one in each for key in one)
    return [key for key in keys if len({one.get(key) for one in each}) > 1]


def _changes(one: Found) -> dict[str, str]:
    return {"experiment": one.run.experiment, **title.changes(one.overrides)}


def _values(one: Found, keys: Iterable[str]) -> list[str]:
    """Its values of these keys; a key that was not given has its experiment's value."""
    return [_changes(one).get(key, "(default)") for key in keys]


def _objective(one: Found) -> float:
    values = [value for value in one.summary.get(OBJECTIVE, []) if value is not None]
    return median(values) if values else float("inf")


def _sentence(order: Sequence[Found]) -> str:
    best, count = order[0], len(order)
    found = meaning.joined([str(each) for each in meaning.estimates(best.summary)])
    value = meaning.number(_objective(best))
    return (
        f"Of {count} runs, {best.title} has the least total error in the last quarter of its episodes "
        f"({value}); all its samples give {found}."
    )


def _numbers_titles(order: Sequence[Found]) -> list[str]:
    names = dict.fromkeys(each.name for one in order for each in meaning.estimates(one.summary))
    return ["e_total, last quarter", "e_total, best", "|estimate - true|", *names]


def _numbers(one: Found) -> list[str]:
    summary = one.summary
    head = [_objective(one), summary.get("e_total"), summary.get("theta_error")]
    known = (meaning.rounded(each.value, each.interval) for each in meaning.estimates(summary))
    return [*(meaning.number(value) for value in head), *known]


def _effect(order: Sequence[Found], key: str) -> Effect:
    """The objective at each value of a key, whatever else varies."""
    from fieldrl.figures import sweeps

    groups: dict[str, list[float]] = {}
    for one in order:
        groups.setdefault(_values(one, [key])[0], []).append(_objective(one))
    at, results = sweeps.ordered(list(groups), list(groups.values()))
    rows = [[value, str(len(found)), _spread(found)] for value, found in zip(at, results, strict=True)]
    drawing = sweeps.line_figure(key, at, results, "e_total, last quarter")
    return Effect(key, rows, _picture(drawing, key))


def _spread(values: Sequence[float]) -> str:
    if len(values) < 2:
        return meaning.number(values[0])
    low, middle, high = (meaning.number(value) for value in quantiles(values, n=4, method="inclusive"))
    return f"{middle} [{low}, {high}]"


def _learning(order: Sequence[Found]) -> list[Picture]:
    """Total error over the episodes of few runs in one figure."""
    from fieldrl.figures.learning import compared_figure

    records = {one.title: _record(one) for one in order}
    if len(records) > _COMPARED or any(record is None for record in records.values()):
        return []
    if any(record.sizes["episode"] < 2 for record in records.values() if record is not None):
        return []
    return [_picture(compared_figure(records), "Learning", "Total error of the episodes, rolling mean.")]


def _label(one: Found, keys: Sequence[str]) -> str:
    """What tells it from the others."""
    given = {key: value for key, value in _changes(one).items() if key in keys}
    experiment = given.pop("experiment", "")
    return title.title(experiment, given) if given or experiment else one.title


def _path(one: Found, label: str) -> Picture:
    """The best episode of its first replicate."""
    from fieldrl.figures.paths import best_path_figure

    return _picture(best_path_figure(_record(one)), label)


def _record(one: Found) -> Any:
    return netcdf.read(one.run.folder / "record.nc", one.run.key)


def _picture(drawing: Figure, heading: str, caption: str = "") -> Picture:
    from fieldrl.figures.files import png

    return run_page.Picture.drawn(png(drawing), heading, caption)
