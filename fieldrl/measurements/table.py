"""A table of samples as it came: columns with their units, before anything is understood of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fieldrl.core.checks import FieldrlError


@dataclass(frozen=True)
class Column:
    """What a file says of a column beside its numbers.

    Args:
        name: as the file has it, without a unit in brackets.
        unit: "" where none is said.
        standard_name: of the CF conventions, "" where none is said.
    """

    name: str
    unit: str = ""
    standard_name: str = ""


@dataclass(frozen=True)
class Table:
    """Rows of columns.

    Args:
        source: what is read, for messages.
        columns: what is said of each, by its key in ``frame``.
        frame: the content, a pandas.DataFrame.
    """

    source: str
    columns: Mapping[str, Column]
    frame: Any = field(repr=False)

    def __len__(self) -> int:
        return len(self.frame)


class Unreadable(FieldrlError):
    """A file or table that cannot be understood; ``key`` is a column or a setting.

    Args:
        source: the file.
        problem: what is wrong with it, and the way out.
    """

    def __init__(self, source: str, problem: str) -> None:
        super().__init__(source, problem)
        self.source, self.problem = source, problem

    def __str__(self) -> str:
        return f"{self.source}: {self.problem}"


def of_columns(content: Any, source: str = "table") -> Table:
    """A table from a pandas DataFrame or a mapping of columns.

    Raises:
        Unreadable: it is neither, or its columns differ in length.
    """
    import pandas as pd

    try:
        frame = pd.DataFrame(content)
    except (ValueError, TypeError) as error:
        raise Unreadable(source, f"is no table: {error}") from error
    return Table(source, {str(name): Column(str(name)) for name in frame.columns}, frame.rename(columns=str))
