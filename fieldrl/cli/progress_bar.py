"""A bar of all replicates' progress on the terminal."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from rich.console import Console, RenderableType
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

_RESULT = "return [bold]{task.fields[reward]}[/]  e_total [bold]{task.fields[error]}[/]"


class ProgressBar(Progress):
    """One bar, drawn anew from what replicates report.

    Args:
        rows: (episodes done, return, e_total) of each replicate, written while they go, (replicates, 3).
        episodes: of a replicate.
        console: a terminal.
    """

    def __init__(self, rows: NDArray[np.float64], episodes: int, console: Console) -> None:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(bar_width=None, complete_style="cyan", finished_style="cyan"),
            MofNCompleteColumn(),
            TextColumn(_RESULT),
            TimeRemainingColumn(compact=True),
        )
        self.rows = rows
        super().__init__(*columns, console=console, transient=True, expand=True, refresh_per_second=8)
        self.add_task("episodes", total=len(rows) * episodes, reward="-", error="-")

    def get_renderables(self) -> Iterable[RenderableType]:
        """The bar as it is now, with the medians over the replicates that have finished an episode."""
        started = np.array(self.rows[self.rows[:, 0] > 0])
        for task in self.tasks:
            if len(started):
                middle = np.median(started[:, 1:], axis=0)
                reward, error = (f"{value:.3g}" for value in middle)
                self.update(task.id, completed=int(started[:, 0].sum()), reward=reward, error=error)
        return super().get_renderables()
