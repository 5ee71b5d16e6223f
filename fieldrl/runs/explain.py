"""An error of a run in one to three lines that name the key, the value, the rule and the way out."""

from __future__ import annotations

from fieldrl.core.checks import FieldrlError


def explain(error: BaseException) -> str:
    """What a user reads."""
    if isinstance(error, FieldrlError):
        return str(error).replace("=None:", "=null:")
    if isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror or first_line(error)}; finished runs are untouched"
    if isinstance(error, MemoryError):
        return "not enough memory; parallel.jobs=1 needs the least"
    return (
        f"unexpected {type(error).__name__}: {first_line(error)}\nHYDRA_FULL_ERROR=1 shows where it happened"
    )


def first_line(error: BaseException) -> str:
    """The first line of an error's message, or its type."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0] if lines else type(error).__name__
