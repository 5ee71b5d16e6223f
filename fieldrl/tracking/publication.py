"""Runs as MLflow shows them: one, with a child for each of several replicates; or all those of a sweep.

A sweep is a parent run, found by the tag ``sweep``; its jobs are children, found by the tag ``job`` (their
overrides), each in its own experiment. So a sweep that is continued, by whichever process, continues the same
runs. A run of its own that was interrupted is found by its key.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import xarray as xr
from filelock import FileLock, Timeout
from mlflow.entities import Run
from mlflow.exceptions import MlflowException

from fieldrl import __version__
from fieldrl.runs import metrics
from fieldrl.runs.folder import json_of, lock_folder, note_tracked, tracked
from fieldrl.tracking import presentation
from fieldrl.tracking.database import PARENT, Database, source

_WINDING_UP = 10.0  # how long a publisher whose run was killed may take to end [s]

Told = Mapping[str, Any]
"""What is told of a run; see ``runs.job.Job.told``."""


@dataclass
class Published:
    """A run in MLflow.

    Args:
        run_id: MLflow's.
        status: RUNNING, FINISHED, FAILED or KILLED.
        replicates: run id of each replicate that has a run of its own, by number.
        each: curves of each replicate that is finished; see ``metrics.curves``.
    """

    run_id: str
    status: str
    replicates: dict[str, str] = field(default_factory=dict)
    each: dict[int, metrics.Series] = field(default_factory=dict)


class Publication:
    """What one publishing process has to do with: a run, or a sweep.

    Args:
        uri: an MLflow server or database; None for SQLite in the output folder.
        output_dir: of everything that runs write.
        experiment: of the run, or of a sweep's first job.
        sweep: name, title, key, arguments, objective and command of the sweep; None for a run of its own.
    """

    def __init__(
        self, uri: str | None, output_dir: str, experiment: str, sweep: Mapping[str, Any] | None = None
    ) -> None:
        self.database = Database(uri, Path(output_dir))
        self.client, self.sweep, self.parent = self.database.client, sweep, ""
        self.tags = source() | {"version": __version__}
        self.runs: dict[str, Published] = {}
        self.lock: FileLock | None = None
        experiment_id = self.database.experiment(experiment)
        if sweep is not None:
            self._open(experiment_id, sweep)

    def begin(self, run: Told) -> Published:
        """A run is computed: it is RUNNING, under the id that it has where it was begun before."""
        experiment_id, known = self.database.experiment(run["experiment"]), self.runs.get(run["label"])
        tags = self.tags | {"key": run["key"], "folder": run["folder"], "status": "running", "kind": "run"}
        tags |= {"experiment": run["experiment"]}
        if self.sweep is not None:
            tags |= {"job": run["label"], "kind": "job", PARENT: self.parent}
        else:
            known = known or self._interrupted(experiment_id, run)
        if known is None:
            begun = self.client.create_run(experiment_id, run_name=run["name"], tags=tags)
            known = Published(begun.info.run_id, "")
        elif known.status != "RUNNING" or self.sweep is None:
            self.client.update_run(known.run_id, "RUNNING")
            for tag, value in tags.items():
                self.client.set_tag(known.run_id, tag, value)
        self.runs[run["label"]] = known
        known.status = "RUNNING"
        self.database.log_params(known.run_id, presentation.parameters(run["config"]))
        return known

    def replicate(self, run: Told, number: int, curves: metrics.Series) -> None:
        """A replicate is finished: its curves."""
        published = self.runs.get(run["label"])
        if published is None or published.status != "RUNNING":
            return
        published.each[number] = curves
        run_id = published.run_id
        if run["replicates"] > 1:
            run_id = self._replicate(published, run, number)
        self.database.log_series(run_id, curves)
        if run_id != published.run_id:
            self.database.terminate(run_id, "FINISHED")

    def done(self, run: Told) -> None:
        """A run is finished and on disk: publish it unless that was done."""
        folder = Path(run["folder"])
        published = self.runs.get(run["label"])
        if published is None or published.status != "FINISHED":
            published = self._adopted(run) or self._complete(run)
        note: dict[str, Any] = {"run_id": published.run_id}
        if self.sweep is not None:
            known = tracked(folder)
            note |= known
            note["sweeps"] = list(dict.fromkeys([*known.get("sweeps", ()), self.sweep["key"]]))
        note_tracked(folder, note)

    def failed(self, run: Told, reason: str) -> None:
        """A run failed: say why."""
        published = self.begin(run)
        self.client.set_tag(published.run_id, "reason", reason)
        self.client.set_tag(published.run_id, presentation.NOTE, reason)
        self._end(published, "FAILED")

    def give_up(self, run: Told) -> None:
        """Something about this run cannot be published."""
        published = self.runs.get(run["label"])
        if published is not None and published.status == "RUNNING":
            self._end(published, "FAILED")

    def close(
        self, folder: str, tags: Told, numbers: Mapping[str, float], status: str, rows: Sequence[Told]
    ) -> None:
        """The sweep is over: its table and pictures, the best job, how many failed."""
        about = self.sweep or {}
        note = presentation.sweep_note(rows, about["objective"], about["command"])
        self.client.set_tag(self.parent, presentation.NOTE, note)
        for name, value in tags.items():
            self.client.set_tag(self.parent, name, value)
        for name, value in numbers.items():
            self.client.log_metric(self.parent, name, value)
        for path in sorted(Path(folder).iterdir()):
            if path.name.startswith(".") or path.name == "tracking.json":
                continue
            if path.is_dir():
                self.client.log_artifacts(self.parent, str(path), path.name)
            else:
                self.client.log_artifact(self.parent, str(path))
        self.database.terminate(self.parent, status)
        note_tracked(Path(folder), {"run_id": self.parent})
        self.parent = ""

    def end(self, status: str) -> None:
        """End what is still running, as FAILED or KILLED."""
        for published in self.runs.values():
            if published.status == "RUNNING":
                self._end(published, status)
        if self.parent:
            self.database.terminate(self.parent, status)

    def _open(self, experiment_id: str, sweep: Mapping[str, Any]) -> None:
        """Find the sweep, or create it, and mark it as running."""
        known = self.database.search(f"tags.sweep = '{sweep['key']}'", [experiment_id])
        if known:
            self.parent = known[0].info.run_id
            self.client.update_run(self.parent, "RUNNING")
        else:
            tags = self.tags | {
                "sweep": sweep["key"],
                "overrides": " ".join(sweep["arguments"]),
                "kind": "sweep",
            }
            begun = self.client.create_run(experiment_id, run_name=sweep["title"], tags=tags)
            self.parent = begun.info.run_id
            given = (text.partition("=") for text in sweep["arguments"])
            self.database.log_params(self.parent, {key: value for key, _, value in given})
        self.client.set_tag(self.parent, "status", "running")
        for run in self.database.children(self.parent):
            if "job" in run.data.tags:
                self.runs[run.data.tags["job"]] = self._found(run)

    def _interrupted(self, experiment_id: str, run: Told) -> Published | None:
        """The run under its key that was interrupted last; those whose process is gone are KILLED.

        A publisher holds the lock of its run for as long as it lives. Who gets it knows that what is said to
        be RUNNING from the same folder is not.
        """
        alone = self._hold(f"{run['experiment']}-{run['key']}")
        condition = f"tags.key = '{run['key']}' and attributes.status != 'FINISHED'"
        left = []
        for found in reversed(self.database.search(condition, [experiment_id])):
            running, here = found.info.status == "RUNNING", found.data.tags.get("folder") == run["folder"]
            if {"job", "replicate"} & found.data.tags.keys() or (running and not (here and alone)):
                continue
            if running:
                self._end(self._found(found), "KILLED")
            left.append(found)
        return self._found(left[0]) if left and not run["afresh"] else None

    def _hold(self, name: str) -> bool:
        """Hold the publication of a run, until this process ends; False where another one does."""
        self.lock = self.lock or FileLock(lock_folder(self.database.output_dir) / f"{name}.mlflow.lock")
        try:
            self.lock.acquire(timeout=_WINDING_UP)
        except Timeout:
            return False
        return True

    def _found(self, run: Run) -> Published:
        return Published(run.info.run_id, run.info.status)

    def _adopted(self, run: Told) -> Published | None:
        """A run that was published on its own becomes a child of this sweep, where that is possible."""
        known = tracked(Path(run["folder"]))
        if self.sweep is None or run["label"] in self.runs or "run_id" not in known or known.get("sweeps"):
            return None
        try:
            found = self.client.get_run(known["run_id"])
        except MlflowException:  # another database than this one
            return None
        experiment_id = self.database.experiment(run["experiment"])
        if (found.info.experiment_id, found.info.status) != (experiment_id, "FINISHED"):
            return None
        self.client.set_tag(found.info.run_id, PARENT, self.parent)
        self.client.set_tag(found.info.run_id, "job", run["label"])
        self.runs[run["label"]] = self._found(found)
        return self.runs[run["label"]]

    def _complete(self, run: Told) -> Published:
        """Metrics and files of a finished run; from its record, where its replicates have not been told."""
        published, folder = self.runs.get(run["label"]), Path(run["folder"])
        if published is None or published.status != "RUNNING":
            published = self.begin(run)
        if len(published.each) < run["replicates"]:
            with xr.open_dataset(folder / "record.nc", engine="netcdf4") as record:
                each = metrics.all_curves(record)
            for number, curves in enumerate(each):
                self.replicate(run, number, curves)
        if run["replicates"] > 1:
            each = [published.each[number] for number in range(run["replicates"])]
            self.database.log_series(published.run_id, metrics.middle(each))
        summary = json_of(folder / "summary.json")
        self.database.log_numbers(published.run_id, metrics.final(summary))
        self._describe(published.run_id, run, summary)
        for name in ("report.html", "record.nc", "summary.json"):
            if not (folder / name).exists():  # a run of an earlier version
                continue
            self.client.log_artifact(published.run_id, str(folder / name))
        self.client.log_artifacts(published.run_id, str(folder / "figures"), "figures")
        self.client.log_artifacts(published.run_id, str(folder / ".hydra"), "config")
        self._end(published, "FINISHED")
        published.each.clear()  # a sweep may have thousands of runs
        return published

    def _describe(self, run_id: str, run: Told, summary: Mapping[str, Any]) -> None:
        """The note of a run, and of its experiment where that has none: description and columns."""
        self.client.set_tag(run_id, presentation.NOTE, presentation.run_note(summary, run["command"]))
        tags = {presentation.NOTE: presentation.experiment_note(run["experiment"], summary)}
        tags[presentation.VIEW_TAG] = presentation.view(summary)
        self.database.describe(run["experiment"], tags)

    def _replicate(self, published: Published, run: Told, number: int) -> str:
        """The child of a replicate, which is looked for where its run was begun before."""
        if not published.replicates:
            found = self.database.children(published.run_id)
            published.replicates = {one.data.tags.get("replicate", ""): one.info.run_id for one in found}
        if str(number) not in published.replicates:
            tags = self.tags | {"key": run["key"], PARENT: published.run_id, "replicate": str(number)}
            tags |= {"kind": "replicate", "experiment": run["experiment"]}
            name = f"replicate {number} of {run['name']}"
            experiment_id = self.database.experiment(run["experiment"])
            child = self.client.create_run(experiment_id, run_name=name, tags=tags)
            published.replicates[str(number)] = child.info.run_id
        return published.replicates[str(number)]

    def _end(self, published: Published, status: str) -> None:
        """End a run; with what is left of its replicates where it is not finished."""
        for one in [] if status == "FINISHED" else self.database.children(published.run_id):
            if one.info.status == "RUNNING":
                self.database.terminate(one.info.run_id, status)
        self.database.terminate(published.run_id, status)
        published.status = status
