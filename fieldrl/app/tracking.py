"""Tracking of runs, seen from the run: what is told to MLflow, and what happens where it does not answer.

Records are the truth and MLflow is a view of them. The view is written by a process of its own
(``publisher.py``): importing MLflow takes longer than many runs, and nothing that happens to it, or in
it, can harm a run. If the run is killed, the publisher sees its pipe close and marks the runs KILLED.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.checks import InvalidValue

Series = Mapping[str, "NDArray"]
"""Metrics by name, each (episodes,)."""

_STALE = ("MLFLOW_RUN_ID", "MLFLOW_EXPERIMENT_ID", "MLFLOW_EXPERIMENT_NAME")
_SETTINGS = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "1",
    "MLFLOW_HTTP_REQUEST_BACKOFF_FACTOR": "1",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "10",
    "OMP_NUM_THREADS": "1",
}


class Untracked:
    """``tracking=none``: nobody is told."""

    def wanted(self, folder: Path) -> bool:
        """Whether the run in ``folder`` is still to be published."""
        return False

    def start(self, output_dir: Path) -> Untracked:
        """Nothing to start."""
        return self

    def begin(self, **run: Any) -> None:
        """Nothing to say."""

    def replicate(self, number: int, series: Series, evaluation: Series) -> None:
        """Nothing to say."""

    def finish(self, folder: Path, metrics: Mapping[str, float], series: Series) -> str:
        """No problem, ever."""
        return ""

    def abandon(self) -> None:
        """Nothing to end."""


@dataclass(frozen=True)
class Mlflow:
    """``tracking=mlflow``.

    Args:
        uri: an MLflow server or database; None for SQLite in the output folder.
        patience: how long the end of a run may wait for MLflow, > 0 [s].
    """

    uri: str | None = None
    patience: float = 60.0

    def __post_init__(self) -> None:
        checks.positive("patience", self.patience, "s")
        if self.uri is not None and "://" not in str(self.uri):
            remedy = "for example http://host:5000, or null for SQLite in output_dir"
            raise InvalidValue("uri", self.uri, "must be null or the URI of an MLflow server", remedy=remedy)

    def wanted(self, folder: Path) -> bool:
        """Whether the run in ``folder`` is still to be published."""
        return not (folder / "tracking.json").exists()

    def start(self, output_dir: Path) -> Publication:
        """Start the publishing process; it creates nothing before ``begin``."""
        return Publication(self.uri, self.patience, output_dir)


class Publication:
    """One run's pipe to the publishing process.

    Args:
        uri: an MLflow server or database; None for SQLite in the output folder.
        patience: how long the end may wait for MLflow [s].
        output_dir: of the run.
        module: the program of the publishing process.
    """

    def __init__(
        self, uri: str | None, patience: float, output_dir: Path, module: str = "fieldrl.app.publisher"
    ) -> None:
        self._uri, self._patience, self._output_dir = uri, patience, output_dir
        self._begun = False
        environment = {key: value for key, value in os.environ.items() if key not in _STALE}
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=_SETTINGS | environment,
            start_new_session=True,  # Ctrl-C is for the run, which then tells the publisher
        )

    def begin(self, **run: Any) -> None:
        """Create the MLflow runs, or continue them: experiment, name, config, tags, replicates, afresh."""
        self._begun = True
        where = {"uri": self._uri, "output_dir": str(self._output_dir)}
        self._send("begin", process=os.getpid(), **where, **run)

    def replicate(self, number: int, series: Series, evaluation: Series) -> None:
        """One replicate is complete: its metrics by learning and by evaluation episode."""
        self._send("replicate", number=number, series=dict(series), evaluation=dict(evaluation))

    def finish(self, folder: Path, metrics: Mapping[str, float], series: Series) -> str:
        """The run is complete and on disk.

        Returns:
            "" when it is in MLflow, else one line that says why it is not.
        """
        self._send("finish", folder=str(folder), metrics=dict(metrics), series=dict(series))
        try:
            answer, _ = self._process.communicate(timeout=self._patience)
            problem = json.loads(answer)["problem"] if answer else "its process ended without an answer"
        except subprocess.TimeoutExpired:
            self._kill()
            problem = f"no answer within {self._patience:g} s (tracking.patience)"
        return (
            f"MLflow did not take this run: {problem}. Its results are complete on disk." if problem else ""
        )

    def abandon(self) -> None:
        """The run failed or was interrupted: the publisher marks what it has begun and ends, also alone."""
        if not self._begun:
            self._kill()
            return
        with suppress(OSError, ValueError, subprocess.TimeoutExpired):
            self._process.communicate(timeout=5)

    def _send(self, kind: str, **content: Any) -> None:
        with suppress(OSError, ValueError):  # a publisher that died says so in ``finish``
            pipe = self._process.stdin
            if pipe is not None:
                pickle.dump((kind, content), pipe)
                pipe.flush()

    def _kill(self) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError, ValueError):
                if pipe is not None:
                    pipe.close()
