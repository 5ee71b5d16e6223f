"""MLflow's database or server: experiments, searches, and metrics and parameters written many at a time.

A metric costs ``log_batch`` about 140 microseconds of SQLAlchemy and a plain insert 12: on a database of our
own the rows of ``metrics`` and ``latest_metrics`` are inserted through MLflow's own table definitions, and by
``log_batch`` where that is not possible.
"""

from __future__ import annotations

import getpass
import re
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock
from mlflow.entities import Metric, Param, Run
from mlflow.exceptions import MlflowException
from mlflow.tracking import MlflowClient

from fieldrl.runs.folder import lock_folder

_BATCH, _PARAMS, _PAGE = 1000, 100, 1000
"""Most metrics, parameters and runs that MLflow takes or gives in one call."""

PARENT = "mlflow.parentRunId"
_KIND = {"mlflow.experimentKind": "custom_model_development"}
"""Has the UI show runs and charts instead of traces and prompts."""


class Database:
    """Where MLflow keeps everything.

    Args:
        uri: an MLflow server or database; None for SQLite in the output folder.
        output_dir: folder of everything that runs write.
    """

    def __init__(self, uri: str | None, output_dir: Path) -> None:
        self.uri, self.output_dir = uri, output_dir
        self._experiments: dict[str, str] = {}
        self._described: set[str] = set()
        with self._first_use():
            self.client = MlflowClient(uri or f"sqlite:///{output_dir / 'mlflow.db'}")

    def experiment(self, name: str) -> str:
        """The id of an experiment, which is created where there is none of that name."""
        if name not in self._experiments:
            with self._first_use():
                known = self.client.get_experiment_by_name(name)
                self._experiments[name] = known.experiment_id if known else self._create(name)
        return self._experiments[name]

    def search(
        self, condition: str, experiment_ids: Sequence[str] = (), order: str = "attributes.start_time ASC"
    ) -> list[Run]:
        """Every run that fulfils a condition, oldest first, in these experiments or in all."""
        ids = list(experiment_ids) or [one.experiment_id for one in self.client.search_experiments()]
        found: list[Run] = []
        token: str | None = ""
        while token is not None:
            page = self.client.search_runs(
                ids, condition, max_results=_PAGE, order_by=[order], page_token=token or None
            )
            found, token = found + list(page), page.token or None
        return found

    def children(self, parent: str) -> list[Run]:
        """Every run below another."""
        return self.search(f"tags.`{PARENT}` = '{parent}'")

    def terminate(self, run_id: str, status: str) -> None:
        """End a run, as FINISHED, FAILED or KILLED."""
        self.client.set_tag(run_id, "status", status.lower())
        self.client.set_terminated(run_id, status)

    def log_params(self, run_id: str, values: Mapping[str, str]) -> None:
        """Parameters, but for those that MLflow knows."""
        known = self.client.get_run(run_id).data.params
        params = [Param(_key(key), text) for key, text in values.items() if _key(key) not in known]
        for i in range(0, len(params), _PARAMS):
            self.client.log_batch(run_id, params=params[i : i + _PARAMS])

    def describe(self, experiment: str, tags: Mapping[str, str]) -> None:
        """Tags of an experiment, those that it has excepted: people may have changed them."""
        if experiment in self._described:
            return
        self._described.add(experiment)
        experiment_id = self.experiment(experiment)
        with self._first_use():  # MLflow fails where two processes set the same new tag at once
            known = self.client.get_experiment(experiment_id).tags
            for name in tags.keys() - known.keys():
                self.client.set_experiment_tag(experiment_id, name, tags[name])

    def log_numbers(self, run_id: str, numbers: Mapping[str, float]) -> None:
        """Metrics of one value each."""
        self.log_series(run_id, {name: np.array([value]) for name, value in numbers.items()})

    def log_series(self, run_id: str, series: Mapping[str, Any]) -> None:
        """Metrics by name, each (steps,), all in one go; nothing is logged twice."""
        now, known = int(time.time() * 1000), self.client.get_run(run_id).data.metrics
        metrics = [
            Metric(_key(name), float(value), now, step)
            for name, values in series.items()
            if _key(name) not in known
            for step, value in enumerate(np.asarray(values, dtype=float))
        ]
        if not metrics or _insert(self.client, run_id, metrics):
            return
        for i in range(0, len(metrics), _BATCH):
            self.client.log_batch(run_id, metrics=metrics[i : i + _BATCH])

    def _create(self, experiment: str) -> str:
        # without an explicit place MLflow would write artifacts to ./mlruns
        place = None if self.uri else (self.output_dir / "mlartifacts" / experiment).as_uri()
        return self.client.create_experiment(experiment, artifact_location=place, tags=_KIND)

    def _first_use(self) -> FileLock:
        """One process at a time makes the database, or an experiment in it, or describes that."""
        return FileLock(lock_folder(self.output_dir) / "mlflow.lock")


def source() -> dict[str, str]:
    """Tags that say who ran what: user, command, and the git commit where fieldrl runs from a checkout."""
    root = Path(__file__).resolve().parents[2]
    tags = {"mlflow.source.name": "fieldrl", "mlflow.source.type": "LOCAL"}
    with suppress(Exception):  # no user name in this container
        tags["mlflow.user"] = getpass.getuser()
    if not (root / ".git").exists():
        return tags
    with suppress(OSError, subprocess.SubprocessError):
        command = ["git", "-C", str(root), "rev-parse", "HEAD"]
        commit = subprocess.run(
            command, capture_output=True, text=True, check=True, timeout=10
        ).stdout.strip()
        tags |= {"git_commit": commit, "mlflow.source.git.commit": commit}
    return tags


def _insert(client: MlflowClient, run_id: str, metrics: list[Metric]) -> bool:
    """Insert new metrics as table rows; False where this MLflow or this store cannot."""
    try:
        from mlflow.store.tracking.dbmodels.models import SqlLatestMetric, SqlMetric
        from mlflow.store.tracking.sqlalchemy_store import SqlAlchemyStore
        from sqlalchemy import insert

        store = client._tracking_client.store
        if not isinstance(store, SqlAlchemyStore):
            return False
        rows = [_row(store, run_id, metric) for metric in metrics]
        latest = {row["key"]: row for row in rows}
        with store.ManagedSessionMaker(read_only=False) as session:
            session.execute(insert(SqlMetric), rows)
            session.execute(insert(SqlLatestMetric), list(latest.values()))
    except (ImportError, AttributeError, TypeError, MlflowException):
        return False
    return True


def _row(store: Any, run_id: str, metric: Metric) -> dict[str, Any]:
    is_nan, value = store.sanitize_metric_value(metric.value)
    return {
        "run_uuid": run_id,
        "key": metric.key,
        "value": value,
        "timestamp": metric.timestamp,
        "step": metric.step,
        "is_nan": is_nan,
    }


def _key(name: str) -> str:
    """A name with only the characters that MLflow takes in keys."""
    return re.sub(r"[^\w\-./: ]", "_", name)
