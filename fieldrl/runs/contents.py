"""What a configuration uses that is not written in it: files, and the code of classes that are not ours.

- A key called ``path``, or one that ends in ``_path``, names a file: its contents count, not where it lies.
- A ``_target_`` outside fieldrl counts with all Python files of its package (of its module, where it is one).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

_OURS = "fieldrl"


def with_contents(config: Any) -> Any:
    """A plain configuration with the digest of each file in place of its path."""
    if isinstance(config, Mapping):
        return {
            key: _file(value) if _names_a_file(key) else with_contents(value) for key, value in config.items()
        }
    return [with_contents(item) for item in config] if isinstance(config, list) else config


def code(config: Any) -> dict[str, str]:
    """Digests of the code of the packages outside fieldrl that a configuration names; imports nothing."""
    roots = sorted({target.partition(".")[0] for target in _targets(config)} - {_OURS})
    return {root: digest for root in roots if (digest := package(root))}


def _names_a_file(key: Any) -> bool:
    return str(key) == "path" or str(key).endswith("_path")


def _file(value: Any) -> Any:
    """The digest of the file of that name; the value itself, where there is none."""
    path = Path(value) if isinstance(value, str) else None
    return {"contents": _digest(path)} if path is not None and path.is_file() else value


def _targets(config: Any) -> Iterator[str]:
    items = (
        config.items()
        if isinstance(config, Mapping)
        else enumerate(config)
        if isinstance(config, list)
        else ()
    )
    for key, value in items:
        if key == "_target_" and isinstance(value, str):
            yield value
        else:
            yield from _targets(value)


@lru_cache(maxsize=64)
def package(root: str) -> str:
    """Of all Python files of a package or module, "" where there is none; as they are when first asked."""
    try:
        found = find_spec(root)
    except (ImportError, ValueError):
        return ""
    if found is None:
        return ""
    folders = sorted(map(Path, found.submodule_search_locations or ()))
    files = [
        (str(file.relative_to(folder)), file) for folder in folders for file in sorted(folder.rglob("*.py"))
    ]
    if not folders and found.origin and Path(found.origin).is_file():
        files = [(root, Path(found.origin))]
    return _joined(f"{name} {_digest(file)}" for name, file in files) if files else ""


def _joined(lines: Iterator[str]) -> str:
    return hashlib.blake2b("\n".join(lines).encode(), digest_size=16).hexdigest()


def _digest(path: Path) -> str:
    about = path.stat()
    return _of_file(path.resolve(), about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=4096)
def _of_file(path: Path, _time: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
