"""Bring the tables and pictures of the contest in docs/learning.md and README.md up to outputs/contest.

python -m pipelines.contest.readme      after make contest and pipelines.contest.learning_curve

Takes seconds.
"""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd

from pipelines import experiments, report
from pipelines.contest import figures, page
from pipelines.contest.learning_curve import COLUMNS, cell
from pipelines.experiments import Settings
from pipelines.paper.readme import replaced, shrink

_COMMAND = "python -m pipelines.contest.readme"
_PLACE = "search, start [30,150], plume drawn"  # where most is to be learned
_HEADS = (
    "agent",
    "error [95 %]",
    "times the oracle's",
    "of the field",
    "identified",
    "e_total",
    "deciding",
    "training",
    "beats random",
)


def make(settings: Settings, root: Path = Path()) -> None:
    """Rewrite the marked parts and the pictures; what has not been computed stays as it is.

    Args:
        settings: where the contest is.
        root: of the repository.
    """
    folder, images = settings.folder.parent / "contest", root / "docs" / "images"
    text = (docs := root / "docs" / "learning.md").read_text()
    if (folder / "results.csv").exists():
        table = pd.read_csv(folder / "results.csv")
        places = page.by_place(table)
        parts = [f"{name}\n\n{report.markdown(_HEADS, page.summary(rows))}" for name, rows in places]
        text = replaced(text, "contest", "\n".join(parts), _COMMAND)
        here = {name: page.course(rows) for name, rows in places if name == _PLACE}
        figures.by_sample(here).savefig(folder / "search.png", dpi=200)
        shrink(folder / "search.png", images / "search.png")
    if (folder / "learning_curve.json").exists():
        numbers = json.loads((folder / "learning_curve.json").read_text())["numbers"]
        rows = [[name, *(cell(row[key]) for key in COLUMNS)] for name, row in numbers.items()]
        text = replaced(text, "learning", report.markdown(("", *COLUMNS.values()), rows), _COMMAND)
        shrink(folder / "learning_curve.png", images / "learning_curve.png")
    docs.write_text(text)


if __name__ == "__main__":
    experiments.command(make)
