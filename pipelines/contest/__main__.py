"""Every agent against every other: missions at several places, what they cost and what they leave unknown.

python -m pipelines.contest [scale=small] [output_dir=FOLDER] [jobs=N]

A case is one agent at one place; it is kept in parts/ when it is done, and the same command goes on.

Takes half an hour on two cores.
"""

from __future__ import annotations

import hashlib
import time
from functools import partial
from pathlib import Path

import pandas as pd

from fieldrl import __version__
from fieldrl.runs import atomic
from fieldrl.runs.identity import RESULTS
from fieldrl.runs.preparation import prepare
from pipelines.contest import page
from pipelines.contest.cases import AGENTS, SCALES, Place, Scale, configuration
from pipelines.contest.missions import missions, of
from pipelines.experiments import Settings, command, fan_out, progress


def contest(settings: Settings) -> None:
    """Compute what is missing, then write results.csv and index.html."""
    scale, folder = SCALES[settings.scale], Path(settings.output_dir) / "contest"
    cases = [(place, agent) for place in scale.places for agent in AGENTS]
    kept = {case: _file(folder, *case, scale) for case in cases}
    missing = [case for case in cases if not kept[case].exists()]
    for place in {place: None for place, _ in missing}:
        prepare(of(place, "random", 1, settings.output_dir).water, Path(settings.output_dir))
    began = time.perf_counter()
    task = partial(_compute, folder=folder, scale=scale, output_dir=settings.output_dir)
    for done, _ in enumerate(fan_out(task, missing, settings), 1):
        progress(done, len(missing), began, "cases")
    table = pd.concat([pd.read_csv(kept[case]) for case in cases], ignore_index=True)
    atomic.write(folder / "results.csv", partial(table.to_csv, index=False))
    page.write(table, folder, scale.episodes, settings.small)
    print(f"{folder / 'index.html'}\n{folder / 'results.csv'}")


def _file(folder: Path, place: Place, agent: str, scale: Scale) -> Path:
    """Where a case is kept: named by everything that it depends on."""
    parts = (*configuration(place, agent, scale.episodes), scale.missions(place), RESULTS, __version__)
    key = hashlib.sha256(repr(parts).encode()).hexdigest()[:10]
    return folder / "parts" / f"{place.experiment}-{agent}-{key}.csv"


def _compute(case: tuple[Place, str], folder: Path, scale: Scale, output_dir: str) -> None:
    path = _file(folder, *case, scale)
    path.parent.mkdir(parents=True, exist_ok=True)
    table = missions(*case, scale.episodes, scale.missions(case[0]), output_dir)
    atomic.write(path, partial(table.to_csv, index=False))


if __name__ == "__main__":
    command(contest)
