"""Missions that are judged, in blocks; each is kept in outputs/calibration/, so that none is done twice."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from fieldrl.runs.atomic import write
from fieldrl.runs.identity import RESULTS
from pipelines.calibration import needed, selection
from pipelines.calibration.cases import judge
from pipelines.calibration.missions import AGENTS, world
from pipelines.experiments import Settings, fan_out, progress

BLOCK = {"advection": 40, "double_gyre": 6}
SMALL = {"advection": (), "double_gyre": ("pde.cells=[48,24]", "pde.order=5", "episodes=4")}
COUNTS = {"paper": {"advection": 340, "double_gyre": 200}, "small": {"advection": 2, "double_gyre": 1}}
"""Missions of each agent, by scale."""

RUNS = {"paper": 200, "small": 2}
"""Runs of many episodes, for what choosing the best does."""

NEEDED = {"paper": 120, "small": 2}
"""Missions of each agent that stop when their intervals are narrow."""

VERSION = 5
"""Of what a block holds; raise it when the same mission gives other rows."""


@dataclass(frozen=True)
class Block:
    """Some missions of an experiment with one agent, or some runs of many episodes (no agent).

    Args:
        experiment: of ``conf/experiment``.
        agent: one of ``AGENTS``; "": runs of many episodes.
        first: number of the first.
        count: how many.
        overrides: of the experiment.
        stopping: missions that stop when their intervals are narrow.
    """

    experiment: str
    agent: str
    first: int
    count: int
    overrides: tuple[str, ...] = ()
    stopping: bool = False

    @property
    def kind(self) -> str:
        """The agent, "" for runs of many episodes; with ``needed`` before it where missions stop."""
        return f"needed {self.agent}" if self.stopping else self.agent

    def path(self, folder: Path) -> Path:
        """Its file."""
        what = self.kind.replace(" ", "-") or "best"
        name = f"{self.experiment}-{what}-{self.first:04d}-{self.count}-r{RESULTS}v{VERSION}"
        return folder / f"{name}.json"

    def rows(self) -> list[dict[str, Any]]:
        """What it finds."""
        one = world(self.experiment, self.agent or "random", self.overrides)
        numbers = range(self.first, self.first + self.count)
        if not self.agent:
            return [row for number in numbers for row in selection.judge(one, number)]
        return [row for number in numbers for row in (needed.judge if self.stopping else judge)(one, number)]


def plan(settings: Settings) -> list[Block]:
    """All blocks, the agents in turns, the dearest last."""
    found = list(_split("advection", "", RUNS[settings.scale], ()))
    for agent in AGENTS:
        parts = _split("advection", agent, NEEDED[settings.scale], ())
        found += [replace(block, stopping=True) for block in parts]
    for experiment, count in COUNTS[settings.scale].items():
        overrides = SMALL[experiment] if settings.small else ()
        each = [block for agent in AGENTS for block in _split(experiment, agent, count, overrides)]
        found += sorted(each, key=lambda block: block.first)
    return found


def _split(experiment: str, agent: str, count: int, overrides: tuple[str, ...]) -> Iterable[Block]:
    size = BLOCK[experiment]
    for first in range(0, count, size):
        yield Block(experiment, agent, first, min(size, count - first), overrides)


def find(settings: Settings) -> dict[tuple[str, str], list[dict]]:
    """The rows by experiment and kind of block; missing ones are computed first, until Ctrl-C."""
    folder, blocks = folder_of(settings), plan(settings)
    folder.mkdir(parents=True, exist_ok=True)
    with contextlib.suppress(KeyboardInterrupt):
        _ensure([block for block in blocks if not block.path(folder).exists()], folder, settings)
    found: dict[tuple[str, str], list[dict]] = {}
    for block in blocks:
        if block.path(folder).exists():
            rows = json.loads(block.path(folder).read_text())
            found.setdefault((block.experiment, block.kind), []).extend(rows)
    return found


def _ensure(missing: list[Block], folder: Path, settings: Settings) -> None:
    started = time.perf_counter()
    for done, _ in enumerate(fan_out(partial(_compute, folder=folder), missing, settings), 1):
        progress(done, len(missing), started, "blocks")


def folder_of(settings: Settings) -> Path:
    """Where blocks, table and picture of a scale go."""
    return Path(settings.output_dir) / "calibration" / settings.scale


def _compute(block: Block, folder: Path) -> None:
    write(block.path(folder), json.dumps(block.rows()).encode())
