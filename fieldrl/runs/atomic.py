"""Files that are either complete or not there: written beside their place, then moved."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fieldrl.core.checks import FieldrlError


def write(path: Path, content: str | bytes | Callable[[Path], Any]) -> Path:
    """Write a file, or fill a folder, at a temporary path; then move it to ``path``.

    Args:
        path: its place.
        content: of the file, or what writes it at the path that it is given.

    Raises:
        FieldrlError: the disk is full or the folder cannot be written; what stood at ``path`` still does.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, str | bytes):
            temporary.write_bytes(content.encode() if isinstance(content, str) else content)
        else:
            content(temporary)
        _replace(temporary, path)
    except OSError as error:
        raise FieldrlError(
            f"{path}: cannot be written ({error.strerror or error}); finished runs are untouched\n"
            "free some space or choose another place with output_dir=FOLDER, then repeat the command"
        ) from error
    finally:
        remove(temporary)
    return path


def _replace(temporary: Path, path: Path) -> None:
    """Move a complete file or folder to its place; a folder that stands there makes way first."""
    if temporary.is_dir() and path.is_dir():
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as aside:
            os.replace(path, Path(aside) / "old")
            os.replace(temporary, path)
    else:
        os.replace(temporary, path)


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
