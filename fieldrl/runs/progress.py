"""Live progress of replicates, wherever they run.

Each replicate writes three numbers into its row of a small memory-mapped file; the parent reads them a
few times a second and shows one bar. Nothing waits for anything.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Report = Callable[[int, float, float], None]
"""report(episode, episode_return, e_total), called by a replicate after each episode."""


@dataclass(frozen=True)
class Progress:
    """Rows (episodes done, return, e_total) of a file that processes share.

    Args:
        path: the file.
        replicates: how many rows.
    """

    path: str
    replicates: int

    def rows(self, mode: str = "r+") -> NDArray[np.float64]:
        """The rows, for the process that calls this, (replicates, 3)."""
        return np.memmap(self.path, dtype=float, mode=mode, shape=(self.replicates, 3))  # type: ignore[call-overload]

    def report(self, number: int) -> Report:
        """The report function of a replicate, for the process that calls this."""
        try:
            row = self.rows()[number]
        except OSError:  # another machine than the one that shows the bar
            return lambda *_: None

        def report(episode: int, episode_return: float, e_total: float) -> None:
            row[:] = episode + 1, episode_return, e_total

        return report


@contextmanager
def shared_progress(replicates: int) -> Iterator[Progress]:
    """Progress of so many replicates, for as long as the body runs."""
    with tempfile.TemporaryDirectory(prefix="fieldrl-") as folder:
        progress = Progress(str(Path(folder) / "progress"), replicates)
        progress.rows("w+")
        yield progress
