"""The process that writes a sweep to MLflow (started by ``tracking.py``, spoken to through its pipe).

It reads (kind, content) messages: "sweep", then "begin", "done" and "failed" of jobs, then "finish". It
answers each with one JSON line, and the end with {"problem": ..., "run_id": ...}. A job that MLflow refuses
does not keep it from publishing the others.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, TextIO

from fieldrl.app.publisher import Message, messages, one_line, quiet_answers


def main() -> None:
    """Serve one sweep."""
    with quiet_answers(step_back=5) as answers:
        _say(answers, serve(messages(), answers))
    os._exit(0)  # MLflow's own threads have nothing left to do


def serve(incoming: Iterator[Message], answers: TextIO) -> dict[str, str]:
    """Publish a sweep from its messages; the first problem is told at the end, nothing raises."""
    from fieldrl.app.sweeps.view import SweepView

    problem, finished = "", False
    view: SweepView | None = None
    for kind, content in incoming:
        try:
            if kind == "sweep":
                view = SweepView.open(**content)
            elif view is not None:
                getattr(view, kind)(**content)
                finished = kind == "finish"
        except Exception as error:  # whatever MLflow, SQLAlchemy, a damaged record or the network raise
            problem = problem or one_line(error)
        _say(answers, {"done": kind})
    if view is not None and not finished:
        with suppress(Exception):
            view.end("KILLED")
    return {"problem": problem, "run_id": view.parent if view else ""}


def _say(answers: TextIO, content: dict[str, Any]) -> None:
    with suppress(OSError):  # the sweep was killed and listens no more
        answers.write(json.dumps(content) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
