"""A sweep's line to MLflow: one publishing process for all of its jobs.

Jobs are published from their folders by ``publisher.py`` while others compute; no worker waits for MLflow.
"""

from __future__ import annotations

import json
import queue
import threading
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from fieldrl.app import files
from fieldrl.app.sweeps.sweep import Sweep
from fieldrl.app.tracking import Mlflow, Publication


class Silence:
    """``tracking=none``: nobody is told."""

    news = False

    def wanted(self, folder: Path, sweep: Sweep) -> bool:
        """Whether the run in ``folder`` is still to be published as a job of the sweep."""
        return False

    def send(self, kind: str, **content: Any) -> None:
        """Nothing to say."""

    def finish(self) -> str:
        """No problem, ever."""
        return ""

    def abandon(self) -> None:
        """Nothing to end."""


class Publisher(Publication):
    """A pipe to the publishing process of a sweep, which is started when there is something to say.

    Args:
        settings: of ``tracking=mlflow``.
        sweep: what is published.
    """

    def __init__(self, settings: Mlflow, sweep: Sweep) -> None:
        self._settings, self._sweep = settings, sweep
        self._started = False
        self._answers: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()

    @property
    def news(self) -> bool:
        """Whether anything has been told."""
        return self._started

    def wanted(self, folder: Path, sweep: Sweep) -> bool:
        """Whether the run in ``folder`` is still to be published as a job of the sweep."""
        return sweep.key not in noted(folder).get("sweeps", ())

    def send(self, kind: str, **content: Any) -> None:
        """One message to the publisher; see ``publisher.py``."""
        if not self._started:
            self._start()
        self._send(kind, **content)

    def finish(self) -> str:
        """Everything has been told.

        Returns:
            "" when it is in MLflow, else one line that says why it is not.
        """
        if not self._started:
            return ""
        self._end_of_messages()
        answer = self._last_answer()
        if answer is None:
            self._kill()
            problem = f"no answer within {self._patience:g} s (tracking.patience)"
        else:
            self._process.wait()
            problem = answer.get("problem", "its process ended without an answer")
        kept = "Its results are complete on disk; the same command tries again."
        return f"MLflow did not take all of this sweep: {problem}. {kept}" if problem else ""

    def abandon(self) -> None:
        """The sweep was interrupted: the publisher marks what runs and ends, also alone."""
        if self._started:
            self._end_of_messages()
            with suppress(Exception):
                self._process.wait(timeout=5)

    def _start(self) -> None:
        super().__init__(
            self._settings.uri,
            self._settings.patience,
            self._sweep.output_dir,
            module="fieldrl.app.sweeps.publisher",
        )
        self._started = True
        threading.Thread(target=self._listen, daemon=True).start()
        self._send(
            "sweep",
            uri=self._settings.uri,
            output_dir=str(self._sweep.output_dir),
            experiment=self._sweep.experiment,
            name=self._sweep.name,
            key=self._sweep.key,
            arguments=list(self._sweep.arguments),
        )

    def _listen(self) -> None:
        pipe = self._process.stdout
        with suppress(OSError, ValueError):
            for line in pipe or ():
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
            latest = answer if "problem" in answer else latest

    def _end_of_messages(self) -> None:
        pipe = self._process.stdin
        with suppress(OSError, ValueError):
            if pipe is not None:
                pipe.close()


def opened(settings: Any, sweep: Sweep) -> Silence | Publisher:
    """What a sweep tells its progress to; ``settings``: the component of the group ``tracking``."""
    return Publisher(settings, sweep) if isinstance(settings, Mlflow) else Silence()


def noted(folder: Path) -> dict[str, Any]:
    """What ``tracking.json`` says about where a run or sweep is in MLflow; empty where nothing is said."""
    try:
        content = json.loads((folder / "tracking.json").read_text())
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def note(folder: Path, content: Mapping[str, Any]) -> None:
    """Keep in ``tracking.json`` where a run or sweep is in MLflow."""
    files.write(folder / "tracking.json", partial(files.write_text, json.dumps(content) + "\n"))
