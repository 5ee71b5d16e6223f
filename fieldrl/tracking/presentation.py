"""How runs read in MLflow: short parameters, notes in Markdown, and the view that its UI opens with.

MLflow keeps a view of the list of runs (columns, order) as a tag of the experiment; its UI takes it from
there where the address says so.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fieldrl.runs import meaning, title
from fieldrl.runs.configuration import GROUPS
from fieldrl.runs.identity import WITHOUT_EFFECT

NOTE = "mlflow.note.content"
VIEW = "fieldrl"
VIEW_TAG = f"mlflow.sharedViewState.{VIEW}"

_TARGET = "_target_"
_ESTIMATES = """\
Estimates from files of samples (`fieldrl estimate`): `pooled/`, with the standard deviation `pooled_std/`
and the width of the 95 % interval `pooled_width/`; errors of the fit; how many `samples` were used; the
standard deviation of the `noise`.
"""
_READING = """\
`e_total`, `theta_error`, `field_rmse` and `best/` are those of the best episode, the one of least total
error; `pooled/` estimates are made from all samples, with the standard deviation `pooled_std/` and the width
of the 95 % interval `pooled_width/`. `late_e_total` is the mean of the last quarter of the
episodes.
"""


def parameters(config: Mapping[str, Any]) -> dict[str, str]:
    """What decides the result, flat and short.

    An option of a group stands as the group's own parameter (``agent``: ``lawnmower``), a part within one as
    its class; numbers have six digits. What cannot change a result, and what is null, is left out.
    """
    return {key: _text(value) for key, value in _flat(config) if value is not None}


def run_note(summary: Mapping[str, Any], command: str) -> str:
    """A finished run: what it means, its numbers, how to repeat it."""
    said = " ".join(meaning.sentences(summary))
    return f"{said}\n\n{_table(*meaning.result_rows(summary))}\n\nRepeat it:\n\n```\n{command}\n```\n"


def sweep_note(rows: Sequence[Mapping[str, Any]], objective: str, command: str) -> str:
    """A finished sweep: its jobs, best first, and how to repeat it.

    Args:
        rows: of its table, best first: varied values by key, and ``value`` of the objective.
        objective: name of what they are compared by.
        command: that repeats it.
    """
    keys = [key for key in rows[0] if key != "value"] if rows else []
    lines = _table(
        [*keys, objective], ([*(row[key] for key in keys), meaning.number(row["value"])] for row in rows)
    )
    return f"Best first:\n\n{lines}\n\nRepeat it:\n\n```\n{command}\n```\n"


def experiment_note(name: str, summary: Mapping[str, Any]) -> str:
    """The description of an experiment, from the head of its option file, and how to read its runs.

    Args:
        name: of the experiment.
        summary: of one of its runs.
    """
    if meaning.from_file(summary):
        return _ESTIMATES
    about, commands = title.about(name)
    shown = "".join(f"`{line}`\n\n" for line in commands)
    return f"{about}\n\n{shown}{_READING}"


def view(summary: Mapping[str, Any]) -> str:
    """The list of runs as it is to be opened: numbers that people compare, newest first, replicates left out.

    Args:
        summary: of one of them.
    """
    errors = ("e_f", "e_cv", "samples") if meaning.from_file(summary) else ("late_e_total", "theta_error")
    columns = ["e_total", *errors, *(f"pooled/{name}" for name in summary["parameters"]), "seconds"]
    found = [f"metrics.`{name}`" for name in columns]
    return json.dumps({
        "orderByKey": "attributes.`Created`", "orderByAsc": False, "startTime": "ALL",
        "searchFilter": "tags.kind != 'replicate'",
        "lifecycleFilter": "Active", "datasetsFilter": [], "modelVersionFilter": "All Runs",
        "selectedColumns": found, "columnOrder": [], "columnWidths": {}, "runsExpanded": {}, "runsPinned": [],
        "runsHidden": [], "runsVisibilityMap": {}, "runsHiddenMode": "FIRST_10_RUNS", "viewMaximized": False,
        "runListHidden": False, "isAccordionReordered": False, "useGroupedValuesInCharts": True,
        "hideEmptyCharts": True, "groupBy": None, "groupsExpanded": {}, "autoRefreshEnabled": True,
        "globalLineChartConfig": {"xAxisKey": "step", "lineSmoothness": 0, "selectedXAxisMetricKey": ""},
    })  # fmt: skip


def _flat(config: Mapping[str, Any], path: str = "") -> Iterable[tuple[str, Any]]:
    for key, value in config.items():
        name = f"{path}.{key}" if path else str(key)
        if key == _TARGET and path:
            module, _, kind = str(value).rpartition(".")
            yield path, module.rpartition(".")[2] if path in GROUPS else kind
        elif name not in WITHOUT_EFFECT and isinstance(value, Mapping):
            yield from _flat(value, name)
        elif name not in WITHOUT_EFFECT:
            yield name, value


def _text(value: Any) -> str:
    """A value as people write it, at most as long as MLflow takes."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(_text(item) for item in value)}]"[:6000]
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:6000]


def _table(titles: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = [f"| {' | '.join(titles)} |", f"|{'---|' * len(titles)}"]
    # a bar within a cell would end it
    return "\n".join(
        [*head, *(f"| {' | '.join(cell.replace('|', '&#124;') for cell in row)} |" for row in rows)]
    )
