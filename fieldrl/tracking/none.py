"""``tracking=none``: nobody is told."""

from __future__ import annotations

from fieldrl.core.kinds import component
from fieldrl.runs.tracker import Tracker


@component
class Untracked(Tracker):
    """Publishes nothing."""
