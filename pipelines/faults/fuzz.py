"""Bad input, at random: hostile values for the configuration's own keys, and what a user would see.

python -m pipelines.faults.fuzz [cases=2000] [seed=0] [jobs=2]

Each case is a command line: an experiment, small, with one or two overrides that may be nonsense. Every value
of ``HOSTILE`` may meet every key and every node. Cases run through ``fieldrl.cli.main.main`` in worker
processes with limits of processor time and memory, one in a hundred as a command of its own. What is valid
runs to its end, unless it is estimated to take longer than a few seconds.

Takes ten minutes.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fieldrl.cli.compose import composed
from pipelines import report
from pipelines.faults import fuzz_workers
from pipelines.faults.fuzz_workers import Seen

SMALL = ("episodes=1", "steps=2", "evaluation_episodes=0", "replicates=1", "tracking=none", "parallel=serial")
WORLDS = (
    ("experiment=advection",),
    ("experiment=double_gyre", "pde.cells=[36,18]", "estimator.budget=8"),
    ("experiment=advection", "agent=lawnmower", "reward=information_gain", "parallel=loky"),
    ("experiment=advection", "estimator=gaussian_process", "estimator.budget=4", "estimator.initial=2"),
    ("experiment=advection", "estimator=composite", "estimator.budget=8", "tracking=mlflow"),
    ("experiment=double_gyre", "pde.cells=[36,18]", "estimator.budget=8", "agent=random"),
    (
        "experiment=advection",
        "pde.source={_target_:fieldrl.pde.source.LocalisedSource,strength:5,centre:[80,80],width:10}",
        "pde.domain.obstacles=[{_target_:fieldrl.core.domain.Circle,centre:[90,60],radius:10}]",
        "agent.step_size_schedule={_target_:fieldrl.agent.schedules.Linear,final:0.1,episodes:200}",
        "agent.exploration_schedule={_target_:fieldrl.agent.schedules.Exponential,rate:0.99}",
    ),
    (
        "experiment=double_gyre",
        "pde.cells=[36,18]",
        "estimator.budget=8",
        "pde.source={_target_:fieldrl.pde.source.LocalisedSource,strength:5,centre:[80,80],width:10}",
        "pde.domain.obstacles=[{_target_:fieldrl.core.domain.Circle,centre:[140,60],radius:10}]",
    ),
    ("experiment=search", "reward=shaped"),
    (
        "experiment=double_gyre",
        "pde.cells=[36,18]",
        "estimator.budget=8",
        "unknown={mu:{true:.25,lower:0,upper:.5},diffusivity:{true:1,lower:.1,upper:3}}",
    ),
)
"""Small versions of the experiments that have, together, every option's keys."""

HOSTILE: Mapping[str, Sequence[str]] = {
    "nothing": ("null", "''", "???", "[]", "{}"),
    "truth values": ("true", "false"),
    "whole numbers": ("-1", "0", "1", "2", "3", "7", "64", "1000", "1000000", "1000000000", "1" + "0" * 22),
    "numbers": ("0.5", "-0.5", "1.5", "1e-3", "1e-300", "1e-22", "1e22", "-1e22", "1e308", "-1e308", "1e6"),
    "no numbers": ("nan", "inf", "-inf"),
    "texts": ("abc", "'1'", "x", "'a b'", "'['", "${seed}", "${sead}", "é", "a" * 300),
    "lists": (
        "[1]", "[1,2]", "[2,1]", "[1,2,3]", "[1,1]", "[0,0]", "[a,b]", "[null,null]", "[true,false]",
        "[nan,1]", "[inf,1]", "[1e308,1e308]", "[-1e308,1e308]", "[1e22,1e22]", "[[1,2],[3,4]]", "[{a:1}]",
        "[10000,5000]", "[1000000,1]", "[x,y,heading,time]", "[1e-300,1e-300]", "['1','2']",
    ),
    "nodes": (
        "{a:1}", "{_target_:null}", "{_target_:fieldrl.vehicle.sensor.Sensor}", "{_target_:no.such.Thing}",
        "{_target_:fieldrl.core.domain.Domain}", "{_target_:fieldrl.pde.initial.InitialFeature}",
        "[{_target_:fieldrl.core.domain.Circle,centre:[1,1],radius:1e9}]", "{1:2}",
        "{_target_:1}", "{_target_:[]}",
    ),
}  # fmt: skip
"""By kind, as they are written on a command line."""

FACTORS = (-1.0, 0.0, 1e-6, 0.1, 0.5, 2.0, 10.0, 1000.0, 1e6)
"""What a number that stands in the configuration is multiplied by."""


@dataclass(frozen=True)
class Case:
    """One command line.

    Args:
        world: an experiment, small.
        hostile: overrides that may be nonsense.
        alone: as a command of its own.
    """

    world: tuple[str, ...]
    hostile: tuple[str, ...]
    alone: bool

    @property
    def arguments(self) -> list[str]:
        """The whole command line; what is given by the world and again is given once."""
        first = {_key(item): item for item in (*SMALL, *self.world)}
        for key in map(_key, self.hostile):
            first.pop(key, None)
        return [*first.values(), *self.hostile]


def cases(count: int, seed: int) -> Iterator[Case]:
    """``count`` cases; the same for the same seed."""
    rng = np.random.default_rng(seed)
    keys = [dict(_walk(composed([*SMALL, *world]))) for world in WORLDS]
    for number in range(count):
        at = int(rng.integers(len(WORLDS)))
        chosen = rng.choice(sorted(keys[at]), size=1 + int(rng.random() < 0.2), replace=False)
        hostile = tuple(_override(str(key), keys[at][str(key)], rng) for key in chosen)
        yield Case(WORLDS[at], hostile, alone=number % 100 == 50)


def judged(case: Case, seen: Seen) -> str:
    """What became of a case, in a word or two."""
    if seen.verdict:
        return seen.verdict
    lines = [line for line in seen.errors.splitlines() if line.strip()]
    if seen.status == 0:
        return "ran"
    if seen.status not in (1, 2) or not lines or "unexpected " in seen.errors or "Traceback" in seen.errors:
        return "unexpected"
    if seen.left:
        return "leftovers"
    clear = len(lines) <= 3 and "refuses these values" not in seen.errors
    if not clear or not any(_names(seen.errors, _key(item)) for item in case.hostile):
        return "unclear"
    return "refused"


def measure(count: int, seed: int, jobs: int) -> Iterator[tuple[Case, Seen, str]]:
    """All cases with what was seen of them, as they end."""
    todo, folder = list(cases(count, seed)), Path(tempfile.mkdtemp(prefix="fieldrl-fuzz-"))
    try:
        for number, seen in fuzz_workers.run([(case.arguments, case.alone) for case in todo], folder, jobs):
            yield todo[number], seen, judged(todo[number], seen)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _walk(node: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every key of the configuration, nodes included, with its value."""
    for key, value in node.items():
        here = f"{path}.{key}" if path else str(key)
        yield here, value
        if isinstance(value, dict):
            yield from _walk(value, here)


def _override(key: str, value: Any, rng: np.random.Generator) -> str:
    """A hostile override of a key: mostly KEY=VALUE, now and then an odd way to write one."""
    kind = str(rng.choice(["value", "near", "odd"], p=[0.55, 0.4, 0.05]))
    near = _near(value, float(rng.choice(FACTORS)), int(rng.integers(2)))
    if kind == "near" and near:
        return f"{key}={near}"
    if kind == "odd":
        return str(
            rng.choice([f"~{key}", f"+{key}=1", f"{key}x=1", f"{key}.x=1", f"+{key}.x=1", f"++{key}=[]"])
        )
    family = HOSTILE[str(rng.choice(list(HOSTILE)))]
    return f"{key}={rng.choice(np.array(family, dtype=object))}"


def _near(value: Any, factor: float, place: int) -> str:
    """A number multiplied by ``factor``, or one number of a list; nothing for other values."""
    if isinstance(value, list) and len(value) > place:
        changed = _near(value[place], factor, 0)
        texts = [changed if i == place else str(item) for i, item in enumerate(value)]
        return f"[{','.join(texts)}]" if changed else ""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    return str(int(value * factor) if isinstance(value, int) else value * factor)


def _names(text: str, key: str) -> bool:
    """Whether a message names a key, or the node that it is in ("the domain" for pde.domain.upper)."""
    *groups, leaf = key.split(".")
    return key in text or leaf in text or any(node in text for node in groups[1:])


def _key(override: str) -> str:
    return override.partition("=")[0].lstrip("+~")


def main() -> None:
    """Run; print every case that is not as it should be, then what became of all of them."""
    options = {"cases": 2000, "seed": 0, "jobs": 2}
    options |= {key: int(value) for key, _, value in (item.partition("=") for item in sys.argv[1:])}
    found, bad = [], []
    for case, seen, verdict in measure(options["cases"], options["seed"], options["jobs"]):
        found.append((case, seen, verdict))
        if verdict not in fuzz_workers.GOOD:
            known = {"verdict": verdict, "arguments": case.arguments, "said": seen.errors, "left": seen.left}
            bad.append(known)
            print(json.dumps(known, ensure_ascii=False), flush=True)
    counts = Counter(verdict for *_, verdict in found)
    rows: list[tuple[str, Any]] = [(what, counts[verdict]) for verdict, what in fuzz_workers.VERDICTS.items()]
    case, seen, _ = max(found, key=lambda one: one[1].seconds)
    rows.append((f"seconds of the slowest, {' '.join(case.hostile)}", f"{seen.seconds:.1f}"))
    report.show(f"{len(found)} hostile command lines, seed {options['seed']}", ("", "cases"), rows)
    report.write("fuzz", options | {"counts": counts, "bad": bad})
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
