"""One run from its composed configuration: check, build, compute or reuse, write, track, show."""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldrl import __version__
from fieldrl.app import config as configuration
from fieldrl.app import console, files, runs
from fieldrl.app.parallel import Workers
from fieldrl.app.progress import Reporter, board
from fieldrl.app.runs import Run

if TYPE_CHECKING:
    import xarray as xr

    from fieldrl.app.tracking import Mlflow, Publication, Untracked
    from fieldrl.mission import Mission

    Tracker = Publication | Untracked


_WARM_STEPS = 3  # enough to enter every compiled loop


@dataclass(frozen=True)
class Replicate:
    """The work of one replicate, as it is sent to a worker.

    Args:
        mission: what is done.
        seed: of the run.
        reporters: where each replicate tells its progress, (replicates,).
    """

    mission: Mission
    seed: int
    reporters: tuple[Reporter, ...]

    def __call__(self, number: int) -> xr.Dataset:
        """The record of replicate ``number``."""
        from fieldrl.mission import run_replicate

        return run_replicate(self.mission, self.seed, number, self.reporters[number].open())


@dataclass(frozen=True)
class Job:
    """A run that may begin: everything in it has been checked.

    Args:
        config: the plain configuration.
        hydra: what Hydra knows of it, by file name: content of ``.hydra/``.
        run: its identity and place.
        workers: who computes.
        tracking: who is told.
    """

    config: Mapping[str, Any]
    hydra: Mapping[str, str]
    run: Run
    workers: Workers
    tracking: Mlflow | Untracked

    @classmethod
    def of(cls, config: Mapping[str, Any], experiment: str, hydra: Mapping[str, str]) -> Job:
        """Check a configuration's top level and what cannot change results; give it its identity."""
        configuration.check(config)
        workers = configuration.build(config["parallel"], "parallel")
        tracking = configuration.build(config["tracking"], "tracking")
        output_dir = Path(config["output_dir"]).expanduser().resolve()
        return cls(config, hydra, Run(experiment, runs.identity(config), output_dir), workers, tracking)


def perform(job: Job) -> dict[str, Any]:
    """Do a run, or find it done; print its result.

    Returns:
        The summary.
    """
    summary = None if job.config["force"] else job.run.summary()
    if summary is None:
        return _perform(job)
    return _reuse(job, summary)


def _perform(job: Job) -> dict[str, Any]:
    """Build everything, then compute, unless another process has just done so."""
    from fieldrl.app import setup

    started = time.time()
    publication = job.tracking.start(job.run.output_dir)
    try:
        mission = setup.mission(job.config)
        with job.run.held(lambda: console.waiting(job.run.name)) as waited:
            done = job.run.summary() if waited or not job.config["force"] else None
            if done is None:
                return _compute(job, mission, publication, started)
        publication.abandon()
        return _reuse(job, done)
    except BaseException:
        publication.abandon()
        raise


def _compute(job: Job, mission: Mission, publication: Tracker, started: float) -> dict[str, Any]:
    """Compute, write everything with the summary last, then end the tracking."""
    from fieldrl.app import metrics
    from fieldrl.figures import draw_run
    from fieldrl.mission import summarise

    console.beginning(job.run.name, job.config, job.workers.count(job.config["replicates"]))
    _begin(job, publication)
    record = _record(job, mission, publication)
    for name, text in job.hydra.items():
        job.run.write(f".hydra/{name}", functools.partial(files.write_text, text))
    job.run.write("record.nc", functools.partial(record.to_netcdf, engine="h5netcdf"))
    job.run.write("figures", functools.partial(draw_run, record))
    each = metrics.each(record)
    extra = {"late_e_total": metrics.late(each), "greedy": metrics.greedy(each)}
    extra |= {"noise": record.attrs["noise"], "seconds": round(time.time() - started, 3)}
    summary = _heading(job) | summarise(record) | extra
    job.run.write("summary.json", functools.partial(files.write_text, json.dumps(summary, indent=2) + "\n"))
    problem = publication.finish(job.run.folder, metrics.final(summary), metrics.middle(each))
    console.result(summary, job.run, problem)
    return summary


def _record(job: Job, mission: Mission, publication: Tracker) -> xr.Dataset:
    """Compute every replicate, showing progress; each is told to the tracking when it is finished."""
    import numpy as np

    from fieldrl.app import metrics
    from fieldrl.mission import combine

    found: dict[int, xr.Dataset] = {}
    parameters = mission.water.parameters
    known = parameters.names, np.array(parameters.true or np.full(len(parameters), np.nan))
    replicates, episodes = job.config["replicates"], job.config["episodes"]
    if job.workers.count(replicates) > 1:
        _warm(mission)
    with board(replicates, episodes, console.console(bar=True)) as reporter:
        task = Replicate(mission, job.config["seed"], tuple(reporter(i) for i in range(replicates)))
        for number, replicate in job.workers.run(task, replicates):
            found[number] = replicate
            series = metrics.series(replicate, *known)
            publication.replicate(number, series, metrics.evaluation(replicate, *known))
    record = combine([found[number] for number in range(replicates)], mission)
    return record.assign_attrs(
        experiment=job.run.experiment, key=job.run.key, seed=job.config["seed"], version=__version__
    )


def _warm(mission: Mission) -> None:
    """Have every loop compiled and on disk before many workers ask for the same ones."""
    from fieldrl.mission import run_replicate

    with console.compiling():
        steps = min(mission.steps, _WARM_STEPS)
        run_replicate(replace(mission, episodes=1, steps=steps, evaluation_episodes=1), 0, 0)


def _reuse(job: Job, summary: dict[str, Any]) -> dict[str, Any]:
    """Show a finished run; publish it where that was not done."""
    problem = _publish(job, summary) if job.tracking.wanted(job.run.folder) else ""
    console.result(summary, job.run, problem, reused=True)
    return summary


def _publish(job: Job, summary: Mapping[str, Any]) -> str:
    """Track a run that is on disk."""
    import xarray as xr

    from fieldrl.app import metrics

    publication = job.tracking.start(job.run.output_dir)
    _begin(job, publication)
    with xr.open_dataset(job.run.folder / "record.nc", engine="h5netcdf") as record:
        each = metrics.each(record)
        for number, (series, evaluation) in enumerate(each):
            publication.replicate(number, series, evaluation)
        return publication.finish(job.run.folder, metrics.final(summary), metrics.middle(each))


def _begin(job: Job, publication: Tracker) -> None:
    publication.begin(
        experiment=job.run.experiment,
        name=job.run.name,
        config=job.config,
        tags={"key": job.run.key, "version": __version__, "status": "running", "folder": str(job.run.folder)},
        replicates=job.config["replicates"],
    )


def _heading(job: Job) -> dict[str, Any]:
    """The part of the summary that comes from the configuration."""
    names = ("seed", "replicates", "episodes", "steps")
    heading = {"experiment": job.run.experiment, "key": job.run.key}
    return heading | {name: job.config[name] for name in names} | {"finished": True, "version": __version__}
