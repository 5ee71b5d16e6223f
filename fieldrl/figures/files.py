"""Pictures on disk: the same bytes for the same record, and a note of what was drawn."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from fieldrl.figures import style


def save(drawing: Figure, path: Path, record: xr.Dataset) -> Path:
    """Write the figure as PNG, and beside it a JSON with the key of the run that it shows.

    Args:
        drawing: the figure.
        path: where to, ending in .png; its folder exists.
        record: the record that was drawn.

    Returns:
        The path.
    """
    return save_noted(drawing, path, provenance(path.name, record))


def save_noted(drawing: Figure, path: Path, note: Mapping[str, object]) -> Path:
    """Write the figure as PNG, and beside it ``note`` as JSON; returns the path."""
    path.write_bytes(png(drawing))
    path.with_suffix(".json").write_text(json.dumps(note, indent=2) + "\n")
    return path


def png(drawing: Figure) -> bytes:
    """The content of a PNG file."""
    content = io.BytesIO()
    drawing.savefig(content, format="png", dpi=style.DPI, metadata={"Software": None})
    return content.getvalue()


def provenance(name: str, record: xr.Dataset) -> dict[str, object]:
    """Which picture this is, and of which run."""
    attrs = record.attrs
    return {
        "file": name,
        "experiment": str(attrs.get("experiment", "")),
        "keys": [str(attrs["key"])] if "key" in attrs else [],
        "version": str(attrs.get("version", "")),
    }
