"""Who is told of runs and sweeps, as far as these know it: nobody. ``fieldrl.tracking`` tells MLflow."""

from __future__ import annotations

from pathlib import Path
from typing import Any


class Publisher:
    """Is told of one run, or of one sweep and its runs; what happens to it harms none of them."""

    def start(self) -> None:
        """Get ready: there will be something to say."""

    def send(self, kind: str, **content: Any) -> None:
        """Something has happened; ``tracking/publication.py`` has a method for each kind."""

    def finish(self) -> str:
        """Everything has been said; "" or a line that says what was not published."""
        return ""

    def abandon(self) -> None:
        """It was interrupted or failed: what is still said to be running is not."""


class Tracker:
    """An option of the group ``tracking``."""

    def wanted(self, folder: Path, sweep: str = "") -> bool:
        """Whether the run in ``folder`` is still to be published, on its own or in the sweep of a key."""
        return False

    def publisher(self, output_dir: Path, experiment: str, sweep: dict[str, Any] | None = None) -> Publisher:
        """A publisher of a run, or of a sweep (see ``publication``); it does nothing before it is told."""
        return Publisher()
