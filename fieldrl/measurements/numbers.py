"""Columns as numbers: text that is none is named by its row, what is missing becomes NaN."""

from __future__ import annotations

import importlib
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.measurements.table import Unreadable

_MISSING = ("", "na", "n/a", "nan", "null", "none", "-", "--", "missing")
_AMBIGUOUS = re.compile(r"\s*\d{1,2}[/.]\d{1,2}[/.]\d{2,4}.*")


def numbers(column: Any, role: str, decimal: str, source: str) -> NDArray[np.float64]:
    """The numbers of a column, NaN where there is none, (n,).

    Args:
        column: text, numbers or anything else.
        role: what the column is, for messages.
        decimal: the mark between whole and decimal digits.
        source: the file, for messages.

    Raises:
        Unreadable: a cell holds text that is no number.
    """
    pd = _pandas()

    if pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_complex_dtype(column):
        return np.array(column, dtype=float)
    text = _text(column)
    if decimal != ".":
        text = text.str.replace(decimal, ".", regex=False)
    text = text.mask(text.str.lower().isin(_MISSING), "nan")
    found = pd.to_numeric(text, errors="coerce").to_numpy(dtype=float)
    wrong = np.flatnonzero(np.isnan(found) & (text.str.lower() != "nan").to_numpy())
    if wrong.size:
        raise _no_number(column, role, int(wrong[0]), wrong.size, source)
    return found


def limits(column: Any) -> tuple[Any, NDArray[np.bool_]]:
    """A column of values in which "<0.5" says that the field was at or below a detection limit.

    Returns:
        The column without these marks, and which rows had one, (n,).
    """
    if column.dtype.kind in "iufb":
        return column, np.zeros(len(column), dtype=bool)
    text = _text(column)
    marked = text.str.startswith("<").to_numpy(dtype=bool)
    return text.str.lstrip("<= "), marked


def dates(column: Any, layout: str | None, source: str) -> NDArray[np.datetime64] | None:
    """Dates with times in UTC, NaT where there is none, (n,); None where the column holds numbers.

    Args:
        column: text, numbers or dates.
        layout: of the text, as ``datetime.strptime`` reads it; None: the usual ones.
        source: the file, for messages.

    Raises:
        Unreadable: some text is no date, or might be two.
    """
    pd = _pandas()

    if pd.api.types.is_numeric_dtype(column):
        return None
    if pd.api.types.is_datetime64_any_dtype(column):
        return np.asarray(pd.to_datetime(column, utc=True).dt.tz_localize(None), dtype="datetime64[ns]")
    text = _text(column)
    given = ~text.str.lower().isin((*_MISSING, "nat"))
    if layout is None and pd.to_numeric(text[given], errors="coerce").notna().any():
        return None  # numbers, though one may be wrong
    if layout is None and text[given].str.fullmatch(_AMBIGUOUS).any():
        which = text[given].iloc[0]
        way_out = "say which is which: measurements.time_format='%d/%m/%Y %H:%M:%S'"
        raise Unreadable(source, f"time: {which!r} may be day or month first; {way_out}")
    found = pd.to_datetime(text.where(given), format=layout or "mixed", errors="coerce", utc=True)
    wrong = np.flatnonzero((found.isna() & given).to_numpy())
    if wrong.size:
        raise _no_number(column, "time", int(wrong[0]), wrong.size, source, "no date and no number")
    return np.asarray(found.dt.tz_localize(None), dtype="datetime64[ns]")


def _pandas() -> Any:
    """pandas, when it is needed: it takes long to import; its own types fit nothing that is done here."""
    return importlib.import_module("pandas")


def _text(column: Any) -> Any:
    return column.astype(object).where(column.notna(), "").astype(str).str.strip()


def _no_number(
    column: Any, role: str, row: int, count: int, source: str, what: str = "no number"
) -> Unreadable:
    text: Any = column.iloc[row]
    more = f" (and {count - 1} more row{'s' if count > 2 else ''})" if count > 1 else ""
    comma = "; a decimal comma? measurements.decimal=','" if re.fullmatch(r"-?\d+,\d+", str(text)) else ""
    return Unreadable(source, f"{role}: row {row + 1} holds {str(text)[:40]!r}, {what}{more}{comma}")
