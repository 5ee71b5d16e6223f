"""What is shown of a run while it goes, as far as the run knows: nothing. The terminal shows more."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.runs.folder import Run


class Display:
    """Shows nothing."""

    def note(self, text: str) -> None:
        """A line beside the results, such as a warning of a model."""

    def beginning(self, run: Run, config: Mapping[str, Any], workers: int, continued: int) -> None:
        """A run begins, or is ``continued`` after so many episodes."""

    def waiting(self, name: str, holder: str) -> None:
        """Another process, ``holder``, works on the same run or sweep."""

    def compiling(self) -> None:
        """Inner loops are compiled: the first time on a machine."""

    def progress(self, rows: NDArray[np.float64], episodes: int) -> AbstractContextManager[object]:
        """Replicates are computed while the body runs.

        Args:
            rows: (episodes done, return, e_total) of each, written while they go, (replicates, 3).
            episodes: learning episodes of a replicate.
        """
        return nullcontext()

    def result(
        self,
        summary: Mapping[str, Any],
        run: Run,
        problem: str,
        reused: bool = False,
        continued: bool = False,
    ) -> None:
        """A run is finished, now or before (``reused``); ``problem``: of the tracking, in a line."""
