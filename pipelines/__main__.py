"""List what can be run: each pipeline in a line, with how long it usually takes.

python -m pipelines
"""

from __future__ import annotations

import ast
import re
import shutil
import textwrap
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parent
_DURATION = re.compile(r"^Takes (.+?)\.$", re.MULTILINE)


class Entry(NamedTuple):
    """A pipeline.

    Args:
        name: of its module, as ``python -m`` takes it.
        what: the first line of its docstring.
        duration: usual, from nothing, on two cores; empty where it is not told.
    """

    name: str
    what: str
    duration: str


def described(path: Path) -> str:
    """The docstring of a file, which is not run."""
    return ast.get_docstring(ast.parse(path.read_text())) or ""


def entries(folder: Path) -> list[Entry]:
    """What can be run of a folder: every file whose docstring shows its own command."""
    found = []
    for path in sorted(folder.glob("*.py")):
        module = path.parent if path.stem == "__main__" else path.with_suffix("")
        name, text = ".".join((ROOT.name, *module.relative_to(ROOT).parts)), described(path)
        if re.search(rf"python -m {re.escape(name)}(?![\w.])", text):
            duration = _DURATION.search(text)
            found.append(Entry(name, text.splitlines()[0], duration[1] if duration else ""))
    return found


def folders() -> dict[str, Path]:
    """Every folder with pipelines, by its name."""
    return {path.parent.name: path.parent for path in sorted(ROOT.glob("*/__init__.py"))}


def main() -> None:
    """Print the list, as wide as the terminal."""
    width = min(shutil.get_terminal_size().columns, 120)
    print("python -m NAME; usual durations on two cores, from nothing: what is finished is kept.")
    for folder in folders().values():
        print(f"\n{_first_line(folder)}")
        for name, what, duration in entries(folder):
            print(f"  {name}{duration and f'  ({duration})'}")
            print(textwrap.fill(what, width, initial_indent=" " * 6, subsequent_indent=" " * 6))


def _first_line(folder: Path) -> str:
    return described(folder / "__init__.py").partition("\n")[0]


if __name__ == "__main__":
    main()
