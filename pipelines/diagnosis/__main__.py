"""Why SARSA(lambda) does not learn from the paper's reward: controls, noise, coverage, what can be won.

    python -m pipelines.diagnosis [scale=small] [output_dir=FOLDER] [jobs=N]

Controls have an answer that is known: a reward for being near the feature must be learned. f is how far the
returns of different paths differ, in standard deviations of the noise in one return. "from 200": the agent's
values begin there, above what any policy returns, and not at 0. Replicates are paired by their streams;
findings are judged as the paper's claims are. Late: the last quarter of the episodes; early: an eighth.

Takes ten minutes.
"""

from __future__ import annotations

from pipelines import artefacts, report
from pipelines.diagnosis import drawing
from pipelines.diagnosis.cases import Place
from pipelines.diagnosis.measured import measure
from pipelines.diagnosis.tables import Table, tables
from pipelines.experiments import Settings, command


def make(settings: Settings) -> list[Table]:
    """Measure what is missing, print the tables, write them, numbers and pictures to outputs/diagnosis/."""
    place = Place(**vars(settings))
    found = measure(place)
    made = tables(found)
    for table in made:
        report.show(*table)
    text = "\n".join(f"## {table.title}\n\n{report.markdown(table.columns, table.rows)}" for table in made)
    artefacts.put(place, "tables.md", text.encode())
    note = {
        "command": "python -m pipelines.diagnosis",
        "scale": place.scale,
        "runs": [run.description for run in found.runs.values()],
        "tables": [table._asdict() for table in made],
        "versions": artefacts.versions(),
    }
    drawing.save(place, "learning", drawing.learning(found), note)
    drawing.save(place, "values", drawing.values(found), note)
    print(place.folder)
    return made


if __name__ == "__main__":
    command(make)
