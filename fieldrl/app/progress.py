"""Live progress of replicates, wherever they run.

Each replicate writes three numbers into its row of a small memory-mapped file; the parent reads them a
few times a second and shows one bar. Nothing waits for anything.
"""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

Report = Callable[[int, float, float], None]
"""report(episode, episode_return, e_total), called by a replicate after each episode."""

_PERIOD = 0.2
_RESULT = "return [bold]{task.fields[reward]}[/]  e_total [bold]{task.fields[error]}[/]"


@dataclass(frozen=True)
class Reporter:
    """What a replicate reports to: one row (episodes done, return, e_total) of a shared file.

    Args:
        path: the file.
        shape: (replicates, 3).
        replicate: which row.
    """

    path: str
    shape: tuple[int, int]
    replicate: int

    def open(self) -> Report:
        """The report function, for the process that calls this."""
        try:
            row = np.memmap(self.path, dtype=float, mode="r+", shape=self.shape)[self.replicate]
        except OSError:  # another machine than the one that shows the bar
            return lambda *_: None

        def report(episode: int, episode_return: float, e_total: float) -> None:
            row[:] = episode + 1, episode_return, e_total

        return report


@contextmanager
def board(replicates: int, episodes: int, console: Console) -> Iterator[Callable[[int], Reporter]]:
    """Show progress while the body runs; yields the maker of each replicate's reporter."""
    shape = (replicates, 3)
    with tempfile.TemporaryDirectory(prefix="fieldrl-") as folder:
        path = str(Path(folder) / "progress")
        rows = np.memmap(path, dtype=float, mode="w+", shape=shape)
        with _shown(rows, episodes, console):
            yield lambda replicate: Reporter(path, shape, replicate)


@contextmanager
def _shown(rows: NDArray[np.float64], episodes: int, console: Console) -> Iterator[None]:
    """Draw the bar from another thread until the body ends; nothing where there is no terminal."""
    if not console.is_terminal:
        yield
        return
    over = threading.Event()
    with _bar(console) as progress:
        task = progress.add_task("episodes", total=rows.shape[0] * episodes, reward="-", error="-")
        thread = threading.Thread(target=_follow, args=(progress, task, rows, over), daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()


def _bar(console: Console) -> Progress:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=None, complete_style="cyan", finished_style="cyan"),
        MofNCompleteColumn(),
        TextColumn(_RESULT),
        TimeRemainingColumn(compact=True),
    )
    return Progress(*columns, console=console, transient=True, expand=True, refresh_per_second=8)


def _follow(progress: Progress, task, rows: NDArray[np.float64], over: threading.Event) -> None:
    while not over.wait(_PERIOD):
        reward, error = _middle(rows)
        progress.update(task, completed=int(rows[:, 0].sum()), reward=reward, error=error)


def _middle(rows: NDArray[np.float64]) -> tuple[str, str]:
    """Median of return and e_total over the replicates that have finished an episode, as text."""
    started = np.array(rows[rows[:, 0] > 0])
    if not len(started):
        return "-", "-"
    return tuple(f"{value:.3g}" for value in np.median(started[:, 1:], axis=0))  # type: ignore[return-value]
