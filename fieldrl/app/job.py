"""One run from its composed configuration: check, build, compute or reuse, write, track, show."""

from __future__ import annotations

import functools
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldrl import __version__
from fieldrl.app import config as configuration
from fieldrl.app import console, files, notes, runs
from fieldrl.app.checkpoints import Checkpoints
from fieldrl.app.cluster import Cluster
from fieldrl.app.parallel import Workers
from fieldrl.app.replicates import Crew
from fieldrl.app.runs import Run

if TYPE_CHECKING:
    import xarray as xr

    from fieldrl.app.tracking import Mlflow, Publication, Untracked
    from fieldrl.mission import Mission

    Tracker = Publication | Untracked


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
    workers: Workers | Cluster
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
    with notes.told(console.note):
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
        checkpoints = Checkpoints(job.run.folder / "checkpoints", job.run.key)
        mission = setup.mission(job.config, checkpoints.solves)
        with job.run.held(lambda holder: console.waiting(job.run.name, holder)) as waited:
            done = job.run.summary() if waited or not job.config["force"] else None
            if done is None:
                return _compute(job, mission, checkpoints, publication, started)
        publication.abandon()
        return _reuse(job, done)
    except BaseException:
        publication.abandon()
        raise


def _compute(
    job: Job, mission: Mission, checkpoints: Checkpoints, publication: Tracker, started: float
) -> dict[str, Any]:
    """Compute, write everything with the summary last, then end the tracking."""
    from fieldrl.app import metrics
    from fieldrl.figures import draw_run
    from fieldrl.mission import summarise

    job.run.tidy()
    if job.config["force"]:
        checkpoints.remove()
    kept = checkpoints.survey(job.config["replicates"])
    before = max((one.seconds for one in kept.values()), default=0.0)
    console.beginning(job.run.name, job.config, job.workers.count(job.config["replicates"]))
    if kept:
        console.continued(sum(one.episodes for one in kept.values()), _episodes(job))
    _begin(job, publication)
    record = _kept_record(job, publication)
    if record is None:
        record = _record(job, mission, checkpoints, publication, before)
    for name, text in job.hydra.items():
        job.run.write(f".hydra/{name}", functools.partial(files.write_text, text))
    job.run.write("figures", functools.partial(draw_run, record))
    each = metrics.each(record)
    extra = {"late_e_total": metrics.late(each), "greedy": metrics.greedy(each)}
    extra |= {"noise": record.attrs["noise"], "seconds": round(before + time.time() - started, 3)}
    summary = _heading(job) | summarise(record) | extra | {"record": job.run.record_digest()}
    job.run.write("summary.json", functools.partial(files.write_text, json.dumps(summary, indent=2) + "\n"))
    checkpoints.remove()
    problem = publication.finish(job.run.folder, metrics.final(summary), metrics.middle(each))
    console.result(summary, job.run, problem, continued=bool(kept))
    return summary


def _kept_record(job: Job, publication: Tracker) -> xr.Dataset | None:
    """The record of a run that lost only what is made from it."""
    from fieldrl.app import metrics, records

    record = None if job.config["force"] else records.read(job.run.folder / "record.nc", job.run.key)
    for number, (series, evaluation) in enumerate([] if record is None else metrics.each(record)):
        publication.replicate(number, series, evaluation)
    return record


def _record(
    job: Job, mission: Mission, checkpoints: Checkpoints, publication: Tracker, before: float
) -> xr.Dataset:
    """Compute and write it; each replicate is told to the tracking when it is finished."""
    import numpy as np

    from fieldrl.app import metrics, records
    from fieldrl.mission import combine

    parameters = mission.water.parameters
    known = parameters.names, np.array(parameters.true or np.full(len(parameters), np.nan))

    def publish(number: int, replicate: xr.Dataset) -> None:
        publication.replicate(
            number, metrics.series(replicate, *known), metrics.evaluation(replicate, *known)
        )

    crew = Crew(job.workers, job.config["replicates"], publish)
    record = combine(crew.compute(mission, job.config["seed"], checkpoints, before), mission)
    record = record.assign_attrs(
        experiment=job.run.experiment, key=job.run.key, seed=job.config["seed"], version=__version__
    )
    records.write(record, job.run.folder / "record.nc")
    return record


def _episodes(job: Job) -> int:
    """All episodes of the run, evaluation included."""
    return job.config["replicates"] * (job.config["episodes"] + job.config["evaluation_episodes"])


def _reuse(job: Job, summary: dict[str, Any]) -> dict[str, Any]:
    """Show a finished run; publish it where that was not done."""
    Checkpoints(job.run.folder / "checkpoints", job.run.key).remove()
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
        afresh=job.config["force"],
    )


def _heading(job: Job) -> dict[str, Any]:
    """The part of the summary that comes from the configuration."""
    names = ("seed", "replicates", "episodes", "steps")
    heading = {"experiment": job.run.experiment, "key": job.run.key}
    return heading | {name: job.config[name] for name in names} | {"finished": True, "version": __version__}
