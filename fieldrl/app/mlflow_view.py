"""A run as MLflow shows it: a parent run, and a child for each replicate where there are several.

Only this file, ``interrupted.py`` and those of sweeps import MLflow. A metric costs ``log_batch`` about 140
microseconds of SQLAlchemy and a plain insert 12: on a database of our own the rows of ``metrics`` and
``latest_metrics`` are inserted through MLflow's own table definitions, and by ``log_batch`` where that is
not possible.
"""

from __future__ import annotations

import getpass
import json
import re
import subprocess
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock
from mlflow.entities import Metric, Param
from mlflow.exceptions import MlflowException
from mlflow.tracking import MlflowClient

from fieldrl.app import interrupted, processes

_BATCH, _PARAMS = 1000, 100
"""Most metrics and parameters that MLflow takes in one call."""

_KIND = {"mlflow.experimentKind": "custom_model_development"}
"""Has the UI show runs and charts instead of traces and prompts."""


class View:
    """One run in MLflow.

    Args:
        client: MLflow's client.
        run_id: the parent run.
        children: run of each replicate, (replicates,); the parent itself where there is one replicate.
    """

    def __init__(self, client: MlflowClient, run_id: str, children: list[str]) -> None:
        self.client, self.run_id, self.children = client, run_id, children

    @classmethod
    def create(
        cls,
        uri: str | None,
        output_dir: str,
        experiment: str,
        name: str,
        config: Mapping[str, Any],
        tags: Mapping[str, str],
        replicates: int,
        afresh: bool = False,
    ) -> View:
        """Create experiment and runs, with the configuration as parameters, or continue what was interrupted.

        Runs of the same key whose process is gone are ended as KILLED; the last of them is continued, under
        its own id, unless the run begins ``afresh``.
        """
        client, experiment_id = connect(uri, Path(output_dir), experiment)
        tags = dict(tags) | source() | processes.identity()
        left = interrupted.runs(client, experiment_id, tags["key"])
        known = left[0] if left and not afresh else None
        parent = interrupted.begun(client, experiment_id, name, tags, known)
        log_config(client, parent, config, known.data.params if known else {})
        if replicates == 1:
            return cls(client, parent, [parent])
        nested = tags | {"mlflow.parentRunId": parent}
        children = interrupted.children(client, experiment_id, parent) if known else {}
        runs = [
            interrupted.begun(
                client,
                experiment_id,
                f"{name} replicate {i}",
                nested | {"replicate": str(i)},
                children.get(str(i)),
            )
            for i in range(replicates)
        ]
        return cls(client, parent, runs)

    def replicate(self, number: int, series: Mapping[str, Any], evaluation: Mapping[str, Any]) -> None:
        """Metrics of a finished replicate, by learning episode and by evaluation episode."""
        run_id = self.children[number]
        log_series(self.client, run_id, {**series, **evaluation})
        if run_id != self.run_id:
            self._terminate(run_id, "FINISHED")

    def finish(self, folder: Path, metrics: Mapping[str, float], series: Mapping[str, Any]) -> None:
        """Final metrics and the files of the run; ``series`` sums up several replicates."""
        if len(self.children) > 1:
            log_series(self.client, self.run_id, series)
        log_series(self.client, self.run_id, {key: np.array([value]) for key, value in metrics.items()})
        for name in ("record.nc", "summary.json"):
            self.client.log_artifact(self.run_id, str(folder / name))
        self.client.log_artifacts(self.run_id, str(folder / "figures"), "figures")
        self.client.log_artifacts(self.run_id, str(folder / ".hydra"), "config")
        self._terminate(self.run_id, "FINISHED")

    def end(self, status: str) -> None:
        """End what is still running, as FAILED or KILLED."""
        for run_id in {self.run_id, *self.children}:
            if self.client.get_run(run_id).info.status == "RUNNING":
                self._terminate(run_id, status)

    def _terminate(self, run_id: str, status: str) -> None:
        self.client.set_tag(run_id, "status", status.lower())
        self.client.set_terminated(run_id, status)


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


def default_uri(output_dir: Path) -> str:
    """The database of an output folder."""
    return f"sqlite:///{output_dir / 'mlflow.db'}"


def connect(uri: str | None, output_dir: Path, experiment: str) -> tuple[MlflowClient, str]:
    """The client and the experiment's id; the first use of a new database is one process's at a time."""
    locks = output_dir / ".locks"
    locks.mkdir(parents=True, exist_ok=True)
    with FileLock(locks / "mlflow.lock"):
        client = MlflowClient(uri or default_uri(output_dir))
        known = client.get_experiment_by_name(experiment)
        if known is not None:
            return client, known.experiment_id
        # without an explicit place MLflow would write artifacts to ./mlruns
        place = None if uri else (output_dir / "mlartifacts" / experiment).as_uri()
        return client, client.create_experiment(experiment, artifact_location=place, tags=_KIND)


def log_config(
    client: MlflowClient, run_id: str, config: Mapping[str, Any], known: Mapping[str, str] | None = None
) -> None:
    """Every value of a nested configuration as a parameter, but for those that are ``known`` by MLflow."""
    params = [Param(_key(key), _text(value)) for key, value in flatten(config).items()]
    params = [param for param in params if param.key not in (known or {})]
    for i in range(0, len(params), _PARAMS):
        client.log_batch(run_id, params=params[i : i + _PARAMS])


def flatten(config: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested dicts as one, with dotted keys."""
    flat: dict[str, Any] = {}
    for key, value in config.items():
        path = f"{prefix}{key}"
        flat |= flatten(value, f"{path}.") if isinstance(value, Mapping) else {path: value}
    return flat


def log_series(client: MlflowClient, run_id: str, series: Mapping[str, Any]) -> None:
    """Metrics by name, each (steps,), all in one go; nothing is logged twice."""
    now, known = int(time.time() * 1000), client.get_run(run_id).data.metrics
    metrics = [
        Metric(_key(name), float(value), now, step)
        for name, values in series.items()
        if _key(name) not in known
        for step, value in enumerate(np.asarray(values, dtype=float))
    ]
    if not metrics or _insert(client, run_id, metrics):
        return
    for i in range(0, len(metrics), _BATCH):
        client.log_batch(run_id, metrics=metrics[i : i + _BATCH])


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


def _text(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return text[:6000]
