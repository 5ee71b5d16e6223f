"""A sweep as MLflow shows it: a parent run, a child for each job, grandchildren for replicates.

The parent is found by the tag ``sweep``, a child by its parent and the tag ``job`` (its overrides): a sweep
that is continued, by whichever process, continues the same runs.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr
from mlflow.entities import Run
from mlflow.exceptions import MlflowException
from mlflow.tracking import MlflowClient

from fieldrl import __version__
from fieldrl.app import metrics
from fieldrl.app.mlflow_view import View, connect, log_config, source
from fieldrl.app.sweeps.task import Each
from fieldrl.app.sweeps.tracking import note, noted

_PAGE = 1000


class SweepView:
    """One sweep in MLflow.

    Args:
        client: MLflow's client.
        experiment_id: where the sweep is.
        parent: run id.
        key: of the sweep.
        jobs: run id and status of every child, by overrides.
    """

    def __init__(
        self,
        client: MlflowClient,
        experiment_id: str,
        parent: str,
        key: str,
        jobs: dict[str, tuple[str, str]],
    ) -> None:
        self.client, self.experiment_id, self.parent, self.key = client, experiment_id, parent, key
        self.jobs = jobs
        self.running: set[str] = set()
        self.tags = source() | {"version": __version__}

    @classmethod
    def open(
        cls, uri: str | None, output_dir: str, experiment: str, name: str, key: str, arguments: Sequence[str]
    ) -> SweepView:
        """Find the sweep, or create it, and mark it as running."""
        client, experiment_id = connect(uri, Path(output_dir), experiment)
        known = _search(client, experiment_id, f"tags.sweep = '{key}'")
        if known:
            parent = known[0].info.run_id
            client.update_run(parent, "RUNNING")
        else:
            tags = source() | {"version": __version__, "sweep": key, "overrides": " ".join(arguments)}
            parent = client.create_run(experiment_id, run_name=name, tags=tags).info.run_id
            log_config(client, parent, {text.partition("=")[0]: text.partition("=")[2] for text in arguments})
        client.set_tag(parent, "status", "running")
        children = _search(client, experiment_id, f"tags.`mlflow.parentRunId` = '{parent}'")
        jobs = {
            run.data.tags["job"]: (run.info.run_id, run.info.status)
            for run in children
            if "job" in run.data.tags
        }
        return cls(client, experiment_id, parent, key, jobs)

    def begin(self, job: str, name: str, key: str, folder: str, config: Mapping[str, Any]) -> str:
        """The child of a job, RUNNING; ``job``: its overrides. Returns its run id."""
        run_id, status = self.jobs.get(job, ("", ""))
        tags = {"job": job, "key": key, "folder": folder, "status": "running"}
        if not run_id:
            tags |= self.tags | {"mlflow.parentRunId": self.parent}
            run_id = self.client.create_run(self.experiment_id, run_name=name or job, tags=tags).info.run_id
            if config:
                log_config(self.client, run_id, config)
        elif status != "RUNNING":
            self.client.update_run(run_id, "RUNNING")
            self.client.set_tag(run_id, "status", "running")
        self.jobs[job] = run_id, "RUNNING"
        self.running.add(job)
        return run_id

    def done(self, job: str, name: str, key: str, folder: str, config: Mapping[str, Any], each: Each) -> None:
        """A job is finished: publish it unless that was done; without ``each``, from its record."""
        place = Path(folder)
        if self.jobs.get(job, ("", ""))[1] != "FINISHED" and not self._adopt(job, place):
            self._publish(self.begin(job, name, key, folder, config), name, place, each)
            self.jobs[job] = self.jobs[job][0], "FINISHED"
        self.running.discard(job)
        known = noted(place)
        sweeps = list(dict.fromkeys([*known.get("sweeps", ()), self.key]))
        note(place, {"run_id": self.jobs[job][0]} | known | {"sweeps": sweeps})

    def failed(
        self, job: str, name: str, key: str, folder: str, config: Mapping[str, Any], reason: str
    ) -> None:
        """A job failed: say why."""
        run_id = self.begin(job, name, key, folder, config)
        self.client.set_tag(run_id, "reason", reason)
        self.client.set_tag(run_id, "mlflow.note.content", reason)
        self._terminate(run_id, "FAILED")
        self.jobs[job] = run_id, "FAILED"
        self.running.discard(job)

    def finish(self, folder: str, tags: Mapping[str, str], numbers: Mapping[str, float], status: str) -> None:
        """The sweep is over: its table and pictures, the best job, how many failed."""
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
        self._terminate(self.parent, status)
        note(Path(folder), {"run_id": self.parent})

    def end(self, status: str) -> None:
        """End what is still running, the parent included."""
        for job in self.running:
            self._terminate(self.jobs[job][0], status)
        self._terminate(self.parent, status)

    def _adopt(self, job: str, folder: Path) -> bool:
        """Make a run that was published on its own a child of this sweep; whether that was possible."""
        known = noted(folder)
        if job in self.jobs or "run_id" not in known or known.get("sweeps"):
            return False
        try:
            run = self.client.get_run(known["run_id"])
        except MlflowException:  # another database than this one
            return False
        if run.info.experiment_id != self.experiment_id or run.info.status != "FINISHED":
            return False
        self.client.set_tag(run.info.run_id, "mlflow.parentRunId", self.parent)
        self.client.set_tag(run.info.run_id, "job", job)
        self.jobs[job] = run.info.run_id, "FINISHED"
        return True

    def _publish(self, run_id: str, name: str, folder: Path, each: Each) -> None:
        """Metrics and files of a finished run, with a grandchild for each of several replicates."""
        summary = json.loads((folder / "summary.json").read_text())
        if not each:
            with xr.open_dataset(folder / "record.nc", engine="h5netcdf") as record:
                each = metrics.each(record)
        view = View(self.client, run_id, self._replicates(run_id, name, len(each)))
        for number, (series, evaluation) in enumerate(each):
            view.replicate(number, series, evaluation)
        view.finish(folder, metrics.final(summary), metrics.middle(each))

    def _replicates(self, run_id: str, name: str, count: int) -> list[str]:
        if count == 1:
            return [run_id]
        known = _search(self.client, self.experiment_id, f"tags.`mlflow.parentRunId` = '{run_id}'")
        found = {run.data.tags.get("replicate"): run.info.run_id for run in known}
        return [
            found.get(str(i)) or self._replicate(run_id, f"{name} replicate {i}", i) for i in range(count)
        ]

    def _replicate(self, parent: str, name: str, number: int) -> str:
        tags = self.tags | {"mlflow.parentRunId": parent, "replicate": str(number)}
        return self.client.create_run(self.experiment_id, run_name=name, tags=tags).info.run_id

    def _terminate(self, run_id: str, status: str) -> None:
        self.client.set_tag(run_id, "status", status.lower())
        self.client.set_terminated(run_id, status)


def _search(client: MlflowClient, experiment_id: str, condition: str) -> list[Run]:
    """Every run of an experiment that fulfils a condition, oldest first."""
    found: list[Run] = []
    token: str | None = None
    while True:
        order = ["attributes.start_time ASC"]
        page = client.search_runs(
            [experiment_id], condition, max_results=_PAGE, order_by=order, page_token=token
        )
        found += page
        token = page.token
        if not token:
            return found
