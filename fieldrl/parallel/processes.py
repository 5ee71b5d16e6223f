"""Processes and threads of this machine: how many, what they inherit, when they end."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import Any

_GLANCE = 0.2  # how often a worker looks whether its parent lives [s]


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _start_trackers() -> None:
    """Start the processes that clean up after a run that was killed; what they find is no news to a user."""
    from joblib.externals.loky.backend import resource_tracker as loky_tracker

    before = os.environ.get("PYTHONWARNINGS")
    quiet = "ignore:resource_tracker:UserWarning"
    os.environ["PYTHONWARNINGS"] = f"{before},{quiet}" if before else quiet
    try:
        for tracker in (resource_tracker, loky_tracker):
            tracker.ensure_running()  # type: ignore[attr-defined]
    finally:
        del os.environ["PYTHONWARNINGS"]
        if before is not None:
            os.environ["PYTHONWARNINGS"] = before


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Processes that are started in here inherit that an interrupt is not for them, but for their parent."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    _start_trackers()  # starting one ends the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with_parent(parent: int) -> None:
    """Have this worker process end when its parent has: what was killed computes no longer."""

    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(_GLANCE)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def single_threaded(task: Callable[[], Any]) -> Any:
    """The result of a task with one thread in linear algebra: more can change the last bits."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):
        return task()
