"""Whether intervals, regions and tests of misfit are true: 1,620 missions, 200 long runs.

    python -m pipelines.calibration [scale=small] [output_dir=FOLDER] [jobs=N]

What is finished stays in outputs/calibration/: after Ctrl-C the tables are of that, and the next one goes on.

Takes half an hour on two cores.
"""

from __future__ import annotations

import sys
from typing import Any

from fieldrl.core.checks import InvalidValue
from fieldrl.figures import files
from fieldrl.runs import atomic
from pipelines import report
from pipelines.artefacts import versions
from pipelines.calibration import blocks, drawing
from pipelines.calibration.tables import tables
from pipelines.experiments import Settings


def make(settings: Settings) -> dict[str, Any]:
    """Judge what is missing; write picture, numbers and tables beside the blocks; returns the numbers."""
    judged = blocks.find(settings)
    found = tables(judged)
    note = {
        "command": "python -m pipelines.calibration",
        "scale": settings.scale,
        "tables": {table.name: table._asdict() for table in found},
        "versions": versions(),
    }
    folder = blocks.folder_of(settings)
    files.save_noted(drawing.draw(judged), folder / "calibration.png", note)
    files.save_noted(drawing.draw_needed(judged), folder / "samples_needed.png", note)
    text = "\n".join(f"## {table.title}\n\n{report.markdown(table.columns, table.rows)}" for table in found)
    atomic.write(folder / "tables.md", text)
    for table in found:
        report.show(table.title, table.columns, table.rows)
    return note


def main() -> None:
    """Judge, print the tables."""
    try:
        settings = Settings.of(sys.argv[1:])
    except InvalidValue as error:
        raise SystemExit(str(error)) from None
    make(settings)
    print(f"* outside the binomial band of 95 % for one unknown or more; {blocks.folder_of(settings)}")


if __name__ == "__main__":
    main()
