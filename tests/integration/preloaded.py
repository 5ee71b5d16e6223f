"""Imported where commands are forked: modules and compiled loops are loaded once, not by every command."""

from __future__ import annotations

from pipelines.faults.__main__ import warm

warm()
