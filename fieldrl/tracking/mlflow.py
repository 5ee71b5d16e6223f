"""``tracking=mlflow``: what is told of a run or a sweep, and what happens where MLflow does not answer.

Records are the truth and MLflow is a view of them. The view is written by a process of its own
(``publisher.py``): importing MLflow takes longer than many runs, and nothing that happens to it, or in
it, can harm a run. If the run is killed, the publisher sees its pipe close and marks the runs KILLED.
"""

from __future__ import annotations

import json
import os
import pickle
import queue
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

from fieldrl.core import checks
from fieldrl.core.checks import InvalidValue
from fieldrl.core.kinds import component
from fieldrl.runs.folder import tracked
from fieldrl.runs.tracker import Publisher, Tracker

_MOST_PATIENCE = 1e6  # what the operating system can wait for in one go [s]
_STALE = ("MLFLOW_RUN_ID", "MLFLOW_EXPERIMENT_ID", "MLFLOW_EXPERIMENT_NAME")
_SETTINGS = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "1",
    "MLFLOW_HTTP_REQUEST_BACKOFF_FACTOR": "1",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "10",
    "OMP_NUM_THREADS": "1",
}
_STEP_BACK = {False: 10, True: 5}  # in priority: a sweep never rests, so its publisher needs some share
_GRACE = 5  # how long an interrupted run waits for its publisher [s]


@component
class Mlflow(Tracker):
    """Publishes everything.

    Args:
        uri: an MLflow server or database; None for SQLite in the output folder.
        patience: how long the end of a run may wait for MLflow to say anything, > 0 [s].
    """

    uri: str | None = None
    patience: float = 60.0

    def __post_init__(self) -> None:
        if checks.positive("patience", self.patience, "s") > _MOST_PATIENCE:
            raise InvalidValue("patience", self.patience, f"must be at most {_MOST_PATIENCE:g}", "s")
        if self.uri is not None and "://" not in str(self.uri):
            remedy = "for example http://host:5000, or null for SQLite in output_dir"
            raise InvalidValue("uri", self.uri, "must be null or the URI of an MLflow server", remedy=remedy)

    def wanted(self, folder: Path, sweep: str = "") -> bool:
        """Whether the run in ``folder`` is still to be published, on its own or in the sweep of a key."""
        known = tracked(folder)
        return sweep not in known.get("sweeps", ()) if sweep else not known

    def publisher(self, output_dir: Path, experiment: str, sweep: dict[str, Any] | None = None) -> Pipe:
        """The pipe to a new publishing process."""
        where = {"uri": self.uri, "output_dir": str(output_dir), "experiment": experiment}
        return Pipe(where | {"sweep": sweep}, self.patience)


class Pipe(Publisher):
    """The pipe to the publishing process of a run or a sweep.

    Args:
        where: to publish; see ``publication.Publication``.
        patience: how long the end may wait for an answer [s].
    """

    def __init__(self, where: dict[str, Any], patience: float) -> None:
        self._where, self._patience = where, patience
        self._process: subprocess.Popen[bytes] | None = None
        self._opened = False
        self._answers: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()

    def start(self) -> None:
        """Start the publishing process, which takes a while to import; it creates nothing yet."""
        environment = {key: value for key, value in os.environ.items() if key not in _STALE}
        step_back = _STEP_BACK[bool(self._where["sweep"])]
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "fieldrl.tracking.publisher", str(step_back)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=_SETTINGS | environment,
            start_new_session=True,  # Ctrl-C is for the run, which then tells the publisher
        )
        threading.Thread(target=self._listen, args=(self._process.stdout,), daemon=True).start()

    def send(self, kind: str, **content: Any) -> None:
        """One message to the publishing process."""
        if self._process is None:
            self.start()
        if not self._opened:
            self._opened = True
            self._write("open", process=os.getpid(), where=self._where)
        self._write(kind, **content)

    def finish(self) -> str:
        """Everything has been told.

        Returns:
            "" when it is in MLflow, else one line that says why it is not.
        """
        if self._process is None:
            return ""
        self._end_of_messages()
        answer = self._last_answer()
        if answer is None:
            problem = f"no answer within {self._patience:g} s (tracking.patience)"
        else:
            problem = answer.get("problem", "its process ended without an answer")
        self._end(0.0 if answer is None else _GRACE)
        what = "this sweep" if self._where["sweep"] else "this run"
        kept = "Its results are complete on disk; the same command tries again."
        return f"MLflow did not take {what}: {problem}. {kept}" if problem else ""

    def abandon(self) -> None:
        """Interrupted or failed: the publisher marks what it has begun and ends, also alone."""
        if self._process is not None:
            self._end_of_messages()
            self._end(_GRACE if self._opened else 0.0, patient=self._opened)

    def _listen(self, pipe: Any) -> None:
        with suppress(OSError, ValueError), pipe:
            for line in pipe:
                self._answers.put(json.loads(line))
        self._answers.put(None)

    def _last_answer(self) -> dict[str, Any] | None:
        """The answer to the last message; None where none came for longer than the patience allows."""
        latest: dict[str, Any] = {}
        while True:
            try:
                answer = self._answers.get(timeout=self._patience)
            except queue.Empty:
                return None
            if answer is None:
                return latest
            latest = answer

    def _write(self, kind: str, **content: Any) -> None:
        pipe = self._process.stdin if self._process else None
        with suppress(OSError, ValueError):  # a publisher that died says so in ``finish``
            if pipe is not None:
                pickle.dump((kind, content), pipe)
                pipe.flush()

    def _end_of_messages(self) -> None:
        pipe = self._process.stdin if self._process else None
        with suppress(OSError, ValueError):
            if pipe is not None:
                pipe.close()

    def _end(self, seconds: float, patient: bool = False) -> None:
        """Wait so long for the process to end; then kill it, or leave it alone where that is ``patient``."""
        process, self._process = self._process, None
        if process is None:
            return
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            if patient:
                threading.Thread(target=process.wait, daemon=True).start()
            else:
                process.kill()
                process.wait()
