"""Where the configuration files are; only the standard library, so that ``--help`` is quick."""

from __future__ import annotations

from pathlib import Path


def directory() -> Path:
    """The folder of the configuration: the live conf/ of a checkout, else the one in the wheel."""
    package = Path(__file__).resolve().parents[1]
    live = package.parent / "conf"
    return live if (package.parent / "pyproject.toml").exists() and live.is_dir() else package / "conf"


def options(group: str) -> list[str]:
    """The options of a group, sorted."""
    return sorted(path.stem for path in (directory() / group).glob("*.yaml"))
