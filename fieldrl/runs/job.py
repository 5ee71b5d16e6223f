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
from fieldrl.core.kinds import check_part
from fieldrl.parallel.workers import Workers
from fieldrl.runs import components, configuration, title, warning_lines
from fieldrl.runs.checkpoints import Checkpoints
from fieldrl.runs.display import Display
from fieldrl.runs.folder import Run
from fieldrl.runs.identity import identity
from fieldrl.runs.preparation import prepare
from fieldrl.runs.replicates import Replicates
from fieldrl.runs.tracker import Publisher, Tracker

if TYPE_CHECKING:
    import xarray as xr

    from fieldrl.mission import Mission


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
    tracking: Tracker

    @classmethod
    def of(cls, config: Mapping[str, Any], experiment: str, hydra: Mapping[str, str]) -> Job:
        """Check a configuration's top level and what cannot change results; give it its identity."""
        configuration.check(config)
        workers = components.build(config["parallel"], "parallel")
        tracking = components.build(config["tracking"], "tracking")
        check_part("parallel", workers, Workers)
        check_part("tracking", tracking, Tracker)
        output_dir = Path(config["output_dir"]).expanduser().resolve()
        return cls(config, hydra, Run(experiment, identity(config), output_dir), workers, tracking)

    @property
    def checkpoints(self) -> Checkpoints:
        """Where its replicates are kept while it is computed."""
        return Checkpoints(self.run.folder / "checkpoints", self.run.key)

    @property
    def overrides(self) -> tuple[str, ...]:
        """What it was asked for with."""
        return title.overrides_of(self.hydra.get("overrides.yaml", ""))

    def told(self, label: str = "", name: str = "") -> dict[str, Any]:
        """What a tracker hears of the run.

        Args:
            label: what tells a sweep's jobs apart.
            name: what people call it; "" for its experiment and what differs from it.
        """
        run, config = self.run, self.config
        return {
            "label": label,
            "experiment": run.experiment,
            "name": name or title.title(run.experiment, title.changes(self.overrides)),
            "command": title.command(run.experiment, self.overrides),
            "key": run.key,
            "folder": str(run.folder),
            "config": config,
            "replicates": config["replicates"],
            "afresh": config["force"],
        }

    def publisher(self) -> Publisher:
        """Who is told of this run."""
        return self.tracking.publisher(self.run.output_dir, self.run.experiment)

    def draw(self, record: xr.Dataset) -> None:
        """Write what Hydra knows of it, and its pictures."""
        from fieldrl.figures import draw_run

        for name, text in self.hydra.items():
            self.run.write(f".hydra/{name}", text)
        self.run.write("figures", functools.partial(draw_run, record))

    def conclude(self, record: xr.Dataset, summary: Mapping[str, Any], told: Mapping[str, Any]) -> None:
        """Write its page and, last of all, its summary."""
        from fieldrl.runs import run_page

        changed = title.changes(self.overrides)
        page = run_page.page(record, summary, self.run.folder, told["name"], told["command"], changed)
        self.run.write("report.html", page)
        self.run.write("summary.json", json.dumps(summary, indent=2) + "\n")
        self.checkpoints.remove()

    def publish(self, told: Mapping[str, Any], again: bool = False) -> str:
        """Publish it, finished, where that was not done; "" or a line that says what was not."""
        if not again and not self.tracking.wanted(self.run.folder):
            return ""
        publisher = self.publisher()
        publisher.send("done", run=told)
        return publisher.finish()


def perform(job: Job, display: Display) -> dict[str, Any]:
    """Do a run, or find it done; show its result.

    Returns:
        The summary.
    """
    with warning_lines.told(display.note):
        summary = None if job.config["force"] else job.run.summary()
        return _perform(job, display) if summary is None else _reuse(job, summary, display)


def _perform(job: Job, display: Display) -> dict[str, Any]:
    """Build everything, then compute, unless another process has just done so."""
    from fieldrl.core import compiled

    started = time.time()
    publisher = job.publisher()
    publisher.start()
    try:
        mission = components.mission(job.config, job.checkpoints.solves)
        with job.run.held(display.waiting) as waited:
            done = job.run.summary() if waited or not job.config["force"] else None
            if done is None:
                with compiled.told(display.compiling):
                    return _compute(job, mission, publisher, display, started)
    finally:
        publisher.abandon()
    return _reuse(job, done, display)


def _compute(
    job: Job, mission: Mission, publisher: Publisher, display: Display, started: float
) -> dict[str, Any]:
    """Compute, write everything with the summary last, then end the tracking."""
    from fieldrl.runs import netcdf

    run, config, checkpoints = job.run, job.config, job.checkpoints
    run.tidy()
    if config["force"]:
        checkpoints.remove()
    kept = checkpoints.survey(config["replicates"])
    started -= max((one.seconds for one in kept.values()), default=0.0)
    display.beginning(run, config, job.workers.size, sum(one.episodes for one in kept.values()))
    publisher.send("begin", run=job.told())
    record = None if config["force"] else netcdf.read(run.folder / "record.nc", run.key)
    if record is None:
        prepare(mission.water, run.output_dir)
        replicates = Replicates(mission, config["seed"], config["replicates"], checkpoints, started)
        record = _record(job, replicates, publisher, display)
        netcdf.write(record, run.folder / "record.nc")
    job.draw(record)
    summary = _summary(job, record, round(time.time() - started, 3))
    job.conclude(record, summary, job.told())
    publisher.send("done", run=job.told())
    display.result(summary, run, publisher.finish(), continued=bool(kept))
    return summary


def _record(job: Job, replicates: Replicates, publisher: Publisher, display: Display) -> xr.Dataset:
    """Compute it; each replicate is published when it is finished."""
    from fieldrl.mission import combine
    from fieldrl.runs import metrics

    parameters, found = replicates.mission.water.parameters, {}
    for number, record in replicates.compute(job.workers, display):
        found[number] = record
        learning, _ = metrics.of_replicate(record, parameters)
        drawn = metrics.curves(learning, parameters)
        publisher.send("replicate", run=job.told(), number=number, curves=drawn)
    record = combine([found[number] for number in range(replicates.count)], replicates.mission)
    known = {"experiment": job.run.experiment, "key": job.run.key, "seed": job.config["seed"]}
    return record.assign_attrs(**known, version=__version__)


def _summary(job: Job, record: xr.Dataset, seconds: float) -> dict[str, Any]:
    """The result in a few numbers, and what a finished run is known by."""
    from fieldrl.mission import summarise
    from fieldrl.runs import metrics

    each = metrics.each(record)
    names = ("seed", "replicates", "episodes", "steps")
    head = {"experiment": job.run.experiment, "key": job.run.key}
    head |= {name: job.config[name] for name in names} | {"finished": True, "version": __version__}
    extra = {"late_e_total": metrics.late(each), "greedy": metrics.greedy(each)}
    extra |= {"noise": record.attrs["noise"], "seconds": seconds}
    return head | summarise(record) | extra | job.run.checksums(record)


def _reuse(job: Job, summary: dict[str, Any], display: Display) -> dict[str, Any]:
    """Show a finished run; publish it where that was not done."""
    job.checkpoints.remove()
    display.result(summary, job.run, job.publish(job.told()), reused=True)
    return summary
