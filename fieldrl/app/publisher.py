"""The process that writes runs to MLflow (started by ``tracking.py``, spoken to through its pipe).

It reads (kind, content) messages from its standard input until that closes and answers once, with one
JSON line: {"problem": "", "run_id": ...}. It runs at a low priority: the run comes first.
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
from pathlib import Path
from typing import Any, TextIO

Message = tuple[str, dict[str, Any]]

_LOCKED = 300.0  # how long a database may stay locked [s]; the run waits no longer than its own patience


def main() -> None:
    """Serve one run."""
    with quiet_answers() as answers:
        json.dump(serve(messages()), answers)
    os._exit(0)  # MLflow's own threads have nothing left to do


def quiet_answers(step_back: int = 10) -> TextIO:
    """Have this process step back behind the run, by so many levels of priority; returns where it answers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError):
        os.nice(step_back)
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # whatever MLflow prints is no answer
    return answers


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


def serve(incoming: Iterator[Message]) -> dict[str, str]:
    """Publish one run from its messages; a failure ends the publishing, never with an exception."""
    try:
        return {"problem": "", "run_id": _publish(incoming)}
    except Exception as error:  # whatever MLflow, SQLAlchemy or the network raise
        for _ in incoming:
            pass
        return {"problem": one_line(error), "run_id": ""}


def _publish(incoming: Iterator[Message]) -> str:
    import mlflow.store.tracking.sqlalchemy_store  # noqa: F401  imported while the run computes

    from fieldrl.app.mlflow_view import View

    view: View | None = None
    try:
        for kind, content in incoming:
            if kind == "begin":
                if content.pop("process", os.getppid()) != os.getppid():
                    return ""  # the run was killed while this process was importing
                view = patiently(View.create, **content)
            elif view is not None and kind == "replicate":
                patiently(view.replicate, **content)
            elif view is not None and kind == "finish":
                folder = Path(content["folder"])
                patiently(view.finish, folder, content["metrics"], content["series"])
                (folder / "tracking.json").write_text(json.dumps({"run_id": view.run_id}) + "\n")
                return view.run_id
    except BaseException:
        _end(view, "FAILED")
        raise
    _end(view, "KILLED")
    return ""


def _end(view: Any, status: str) -> None:
    if view is not None:
        with suppress(Exception):
            patiently(view.end, status)


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
