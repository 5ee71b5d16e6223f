"""Tables in text files: CSV and its relatives."""

from __future__ import annotations

import re
from pathlib import Path

from fieldrl.measurements.table import Column, Table, Unreadable

_SEPARATORS = (",", ";", "\t", "|")
_UNIT = re.compile(r"\s*(.*?)\s*[\[(]\s*(.*?)\s*[\])]\s*")


def read(path: Path, encoding: str) -> Table:
    """The table in a text file, every cell as text; lines that begin with # are comments.

    Args:
        path: the file; its first line names the columns, a unit may stand behind each in brackets.
        encoding: of the text.

    Raises:
        Unreadable: there is no table in it, or it is no text of this encoding.
    """
    import pandas as pd

    try:
        with path.open(encoding="utf-8-sig" if encoding == "utf-8" else encoding, newline="") as file:
            header = next((line for line in file if line.strip() and not line.startswith("#")), "")
            file.seek(0)
            look = {"sep": _separator(header), "skipinitialspace": True, "comment": "#"}
            frame = pd.read_csv(file, dtype=str, keep_default_na=False, **look)
    except (UnicodeError, LookupError) as error:
        hint = "name its encoding: measurements.encoding=latin-1 (or utf-16, cp1252)"
        raise Unreadable(str(path), f"is no text in {encoding} ({_first(error)}); {hint}") from error
    except pd.errors.EmptyDataError as error:
        raise Unreadable(str(path), "is empty; its first line must name the columns") from error
    except (pd.errors.ParserError, ValueError) as error:
        raise Unreadable(str(path), f"cannot be read as a table: {_first(error)}") from error
    frame.columns = [str(name) for name in frame.columns]
    return Table(str(path), {name: _column(name) for name in frame.columns}, frame.fillna(""))


def _separator(header: str) -> str:
    """The separator that the header has most of, else white space."""
    most = max(_SEPARATORS, key=header.count)
    return most if most in header else r"\s+"


def _column(header: str) -> Column:
    found = _UNIT.fullmatch(header)
    return Column(found[1], found[2]) if found else Column(header.strip())


def _first(error: BaseException) -> str:
    """The first line of a message, at most 100 characters of it."""
    return " ".join(str(error).split())[:100]
