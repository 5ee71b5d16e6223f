"""The runs behind a figure: declared as configurations, found by their key, computed where they are missing.

A figure is a function of records. Here a pipeline says which runs it wants; those that are finished are taken
as they are, the others are computed in worker processes, one run in each. Everything takes the same options:

    python -m pipelines.paper.figure_3 [scale=small] [tracking=mlflow] [output_dir=FOLDER] [jobs=N]
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import xarray as xr

from fieldrl import __version__
from fieldrl.cli.compose import composed, performed
from fieldrl.core import checks
from fieldrl.core.checks import FieldrlError, InvalidValue
from fieldrl.mission import Mission, run_replicate
from fieldrl.parallel.processes import cores
from fieldrl.runs import atomic
from fieldrl.runs.components import mission
from fieldrl.runs.explain import explain
from fieldrl.runs.identity import RESULTS
from fieldrl.runs.job import Job

SCALES = {
    "paper": {
        "advection": ("replicates=64",), "double_gyre": ("replicates=20",), "search": ("replicates=8",),
    },
    "small": {
        "advection": ("replicates=2", "episodes=12", "steps=5", "evaluation_episodes=1"),
        "double_gyre": (
            "replicates=2", "episodes=2", "steps=3", "evaluation_episodes=0", "pde.cells=[48,24]",
            "estimator.budget=15",
        ),
        "search": ("replicates=2", "episodes=40", "steps=8", "evaluation_episodes=10"),
    },
}  # fmt: skip
"""What a scale adds to each experiment: the paper's size with many replicates, and seconds for CI."""

_HEAVIEST = "double_gyre"

Name = TypeVar("Name")


@dataclass(frozen=True)
class Settings:
    """What every pipeline may be told.

    Args:
        scale: a key of ``SCALES``.
        tracking: option of the group ``tracking`` for runs that are computed; it changes no result.
        output_dir: folder of runs; what pipelines draw goes to its subfolder paper/.
        jobs: worker processes; -1 for one a core.
    """

    scale: str = "paper"
    tracking: str = "none"
    output_dir: str = "outputs"
    jobs: int = -1

    def __post_init__(self) -> None:
        checks.one_of("scale", self.scale, tuple(SCALES))
        checks.integer("jobs", self.jobs)
        if self.jobs < 1 and self.jobs != -1:
            raise InvalidValue("jobs", self.jobs, "must be -1 (all cores) or >= 1")

    @classmethod
    def of(cls, arguments: Sequence[str]) -> Settings:
        """From a command line of KEY=VALUE; raises InvalidValue."""
        given = {}
        for argument in arguments:
            key, _, value = argument.partition("=")
            if key not in cls.__dataclass_fields__ or not value:
                rule = (
                    f"is no option; they are {', '.join(f'{name}=...' for name in cls.__dataclass_fields__)}"
                )
                raise InvalidValue(key, value, rule)
            given[key] = int(value) if key == "jobs" and value.lstrip("-").isdigit() else value
        return cls(**given)

    @property
    def small(self) -> bool:
        """Whether this is the scale for CI."""
        return self.scale == "small"

    @property
    def folder(self) -> Path:
        """Where pictures, their JSON and the page go."""
        return Path(self.output_dir) / "paper"

    @property
    def workers(self) -> int:
        """Worker processes."""
        return cores() if self.jobs == -1 else self.jobs


@dataclass(frozen=True)
class Wanted:
    """A run that a pipeline declares: an experiment and what differs in it, as on the command line."""

    experiment: str
    overrides: tuple[str, ...] = ()

    def at(self, settings: Settings) -> Wanted:
        """The same run at a scale."""
        return replace(self, overrides=(*SCALES[settings.scale][self.experiment], *self.overrides))

    @property
    def command(self) -> str:
        """How a user runs it."""
        return " ".join(["fieldrl", f"experiment={self.experiment}", *self.overrides])


@dataclass(frozen=True, eq=False)
class Found:
    """A finished run."""

    wanted: Wanted
    key: str
    record: xr.Dataset
    seconds: float

    @cached_property
    def mission(self) -> Mission:
        """What was done, with the components that did it."""
        return mission(_configuration(self.wanted))

    @property
    def description(self) -> dict[str, str]:
        """What a reader needs to find the run, or to do it again."""
        return {"key": f"{self.wanted.experiment}-{self.key}", "command": self.wanted.command}


def find(plan: Mapping[Name, Wanted], settings: Settings) -> dict[Name, Found]:
    """The records of declared runs, computed first where they are missing.

    Args:
        plan: runs by name, of any kind, without what the scale adds.
        settings: scale, place and workers.
    """
    scaled = {name: wanted.at(settings) for name, wanted in plan.items()}
    ensure(scaled.values(), settings)
    return {name: _load(wanted, str(Path(settings.output_dir).resolve())) for name, wanted in scaled.items()}


def ensure(plan: Iterable[Wanted], settings: Settings) -> int:
    """Compute the runs that are not finished, one in each worker process; returns how many there were."""
    missing = [wanted for wanted in dict.fromkeys(plan) if not _finished(wanted, settings)]
    if missing:
        started = time.perf_counter()
        _warm(missing)
        missing.sort(key=lambda wanted: wanted.experiment != _HEAVIEST)  # the longest first
        for done, _ in enumerate(fan_out(partial(_compute, settings=settings), missing, settings), 1):
            progress(done, len(missing), started)
    return len(missing)


def kept(
    settings: Settings, name: str, parts: Sequence[Any], compute: Callable[[], xr.Dataset]
) -> xr.Dataset:
    """A dataset derived from records, computed once and then read from outputs/paper/derived/.

    Args:
        settings: its place.
        name: of the file.
        parts: everything that it depends on, plain values only.
        compute: makes it.
    """
    text = json.dumps([name, RESULTS, __version__, list(parts)], sort_keys=True)
    path = settings.folder / "derived" / f"{name}-{hashlib.sha256(text.encode()).hexdigest()[:10]}.nc"
    if not path.exists():
        atomic.write(path, partial(compute().to_netcdf, engine="netcdf4"))
    return xr.load_dataset(path, engine="netcdf4")


def command(make: Callable[[Settings], Any]) -> None:
    """Run a pipeline from the command line; errors are told in a few lines."""
    try:
        make(Settings.of(sys.argv[1:]))
    except FieldrlError as error:
        sys.exit(explain(error))
    except KeyboardInterrupt:
        print("\ninterrupted; finished runs are kept, the same command goes on", file=sys.stderr)
        sys.exit(130)


@cache
def _configuration(wanted: Wanted) -> dict[str, Any]:
    return composed([f"experiment={wanted.experiment}", *wanted.overrides])


def _finished(wanted: Wanted, settings: Settings) -> bool:
    config = _configuration(wanted) | {"output_dir": settings.output_dir}
    return Job.of(config, wanted.experiment, {}).run.summary() is not None


@lru_cache(maxsize=64)
def _load(wanted: Wanted, output_dir: str) -> Found:
    """A finished run from its folder."""
    config = _configuration(wanted) | {"output_dir": output_dir}
    run = Job.of(config, wanted.experiment, {}).run
    record = xr.load_dataset(run.folder / "record.nc", engine="netcdf4")
    return Found(wanted, run.key, record, (run.summary() or {})["seconds"])


def _warm(missing: Sequence[Wanted]) -> None:
    """Have every loop compiled and on disk before many workers ask for the same ones."""
    for experiment in sorted({wanted.experiment for wanted in missing}):
        small = Wanted(experiment).at(Settings(scale="small"))
        run_replicate(replace(mission(_configuration(small)), episodes=1, steps=2), 0, 0)


def fan_out(task: Callable[[Any], Any], plan: Sequence[Any], settings: Settings) -> Iterable[Any]:
    """Do the task for every part of a plan, in this process where there is one worker; yields as they end."""
    workers = min(settings.workers, len(plan))
    if workers <= 1:
        return map(task, plan)
    import joblib

    with joblib.parallel_config("loky", n_jobs=workers, inner_max_num_threads=1):
        parallel: Any = joblib.Parallel(return_as="generator_unordered")
        return parallel(joblib.delayed(task)(wanted) for wanted in plan)


def _compute(wanted: Wanted, settings: Settings) -> None:
    """One run in this process, without its table."""
    where = (f"tracking={settings.tracking}", f"output_dir={settings.output_dir}", "parallel=serial")
    with contextlib.redirect_stdout(io.StringIO()):
        performed(wanted.experiment, [*wanted.overrides, *where])


def progress(done: int, total: int, started: float, what: str = "runs") -> None:
    """One line that a terminal writes over; elsewhere the last one only."""
    text = f"computed {done} of {total} missing {what}, {time.perf_counter() - started:.0f} s"
    if sys.stdout.isatty():
        print(f"\r{text}", end="\n" if done == total else "", flush=True)
    elif done == total:
        print(text)
