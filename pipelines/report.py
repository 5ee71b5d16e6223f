"""What every pipeline leaves: a table in the terminal and a JSON in outputs/."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.table import Table
from rich.text import Text

OUTPUTS = Path("outputs")
_WIDTH = 120  # of a table that goes to a file


def spread(values: ArrayLike, digits: int = 3) -> str:
    """Median and quartiles, as "median [lower, upper]"."""
    low, middle, high = np.percentile(np.asarray(values, dtype=float), [25, 50, 75])
    return f"{middle:.{digits}g} [{low:.{digits}g}, {high:.{digits}g}]"


def show(title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print a table; the first column is text, the others are numbers."""
    table = Table(title=Text(title), title_justify="left")
    for place, name in enumerate(columns):
        table.add_column(Text(name), justify="left" if place == 0 else "right")
    for row in rows:
        table.add_row(*(Text(str(cell)) for cell in row))
    console = Console()
    Console(width=None if console.is_terminal else _WIDTH).print(table)


def markdown(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """The same table as text for the docs."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "".join(
        f"| {' | '.join(str(cell).replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines
    )


def write(name: str, content: dict[str, Any]) -> Path:
    """Write ``content`` with the versions that made it to outputs/NAME.json; returns the path."""
    versions = {package: version(package) for package in ("fieldrl", "numpy", "scipy", "numba")}
    versions["python"] = platform.python_version()
    OUTPUTS.mkdir(exist_ok=True)
    path = OUTPUTS / f"{name}.json"
    path.write_text(json.dumps(content | {"versions": versions}, indent=2) + "\n")
    return path
