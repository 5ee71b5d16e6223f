"""The process that writes to MLflow (started by ``mlflow.py``, spoken to through its pipe).

It reads (kind, content) messages from its standard input until that closes: "open", then whatever
``publication.Publication`` has methods for. It answers each with one JSON line, {"problem": ...}: the first
problem so far. A run that MLflow refuses does not keep it from publishing the others. It runs at a low
priority: the runs come first.
"""

from __future__ import annotations

import json
import os
import pickle
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, TextIO

Message = tuple[str, dict[str, Any]]

_LOCKED = 300.0  # how long a database may stay locked [s]; a run waits no longer than its own patience


def main() -> None:
    """Serve one run or sweep, so many levels of priority behind it as the argument says."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError):
        os.nice(int(sys.argv[1]))
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # whatever MLflow prints is no answer
    serve(messages(), answers)
    os._exit(0)  # MLflow's own threads have nothing left to do


def messages() -> Iterator[Message]:
    """The messages; read by a thread, so that the run never waits for MLflow's import."""
    received: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
    threading.Thread(target=_receive, args=(received,), daemon=True).start()
    while (message := received.get()) is not None:
        yield message


def _receive(received: queue.SimpleQueue[Message | None]) -> None:
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            received.put(pickle.load(sys.stdin.buffer))
    received.put(None)


def serve(incoming: Iterator[Message], answers: TextIO) -> None:
    """Publish from messages; what was begun and not finished when they end is KILLED. Nothing raises."""
    publication, problem = None, ""
    with suppress(ImportError):  # imported while the run computes; "open" says what is wrong
        import mlflow.store.tracking.sqlalchemy_store  # noqa: F401
    for kind, content in incoming:
        try:
            if kind == "open":
                if content["process"] != os.getppid():
                    return  # the run was killed while this process was importing
                publication = patiently(_opened, **content["where"])
            elif publication is not None:
                patiently(getattr(publication, kind), **content)
        except Exception as error:  # whatever MLflow, SQLAlchemy, a damaged record or the network raise
            problem = problem or one_line(error)
            with suppress(Exception):
                if publication is not None and "run" in content:
                    publication.give_up(content["run"])
        with suppress(OSError):  # the run was killed and listens no more
            answers.write(json.dumps({"problem": problem}) + "\n")
            answers.flush()
    if publication is not None:
        with suppress(Exception):
            patiently(publication.end, "KILLED")


def _opened(**where: Any) -> Any:
    from fieldrl.tracking.publication import Publication

    return Publication(**where)


def patiently(action: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """``action(...)``, again and again while another process has the database locked; it may run twice."""
    end = time.monotonic() + _LOCKED
    while True:
        try:
            return action(*args, **kwargs)
        except Exception as error:
            if "database is locked" not in str(error) or time.monotonic() > end:
                raise
        time.sleep(0.5)


def one_line(error: BaseException) -> str:
    """What an error says, on one line of at most 160 characters."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 160 else text[:157] + "..."


if __name__ == "__main__":
    main()
