"""What a pipeline of the paper leaves in outputs/paper/: NAME.pdf, NAME.png and NAME.json.

The JSON holds caption, command, the runs with their keys, versions and every number that is drawn; the same
runs always give the same bytes.
"""

from __future__ import annotations

import io
import json
import math
import platform
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fieldrl.runs import atomic
from pipelines.experiments import Found, Settings

DPI = {"paper": 200, "small": 80}
_PACKAGES = ("fieldrl", "numpy", "scipy", "numba", "scikit-learn", "scikit-optimize", "xarray", "matplotlib")
_DIGITS = 6


def save(
    settings: Settings,
    name: str,
    drawing: Figure,
    caption: str,
    runs: Iterable[Found],
    numbers: dict[str, Any],
    module: str = "",
    **more: Any,
) -> Path:
    """Write a picture and what stands behind it.

    Args:
        settings: where to, and the scale.
        name: of the files, without ending.
        drawing: the figure.
        caption: what it shows, for the page.
        runs: that it was drawn from.
        numbers: that it draws; arrays are rounded to six digits.
        module: pipeline that makes it; its name where that differs.
        more: further entries of the JSON.

    Returns:
        Path of the JSON.
    """
    for ending, metadata in (("png", {"Software": None}), ("pdf", {"CreationDate": None})):
        content = io.BytesIO()
        drawing.savefig(content, format=ending, dpi=DPI[settings.scale], metadata=metadata)
        put(settings, f"{name}.{ending}", content.getvalue())
        drawing.set_layout_engine("none")  # it is laid out now
    return note(settings, name, {"caption": caption, **more}, runs, numbers, module)


def note(
    settings: Settings,
    name: str,
    heading: dict[str, Any],
    runs: Iterable[Found],
    numbers: dict[str, Any],
    module: str = "",
) -> Path:
    """Write NAME.json; see ``save``."""
    scale = " scale=small" if settings.small else ""
    content = {
        "name": name,
        **heading,
        "command": f"python -m pipelines.paper.{module or name}{scale}",
        "scale": settings.scale,
        "runs": list({run.key: run.description for run in runs}.values()),
        "versions": versions(),
        "numbers": plain(numbers),
    }
    return put(settings, f"{name}.json", (json.dumps(content, indent=1) + "\n").encode())


def put(settings: Settings, name: str, content: bytes) -> Path:
    """Write a file of outputs/paper/, whole or not at all; returns its path."""
    return atomic.write(settings.folder / name, content)


def read(settings: Settings, name: str) -> dict[str, Any]:
    """The JSON of a picture."""
    return json.loads((settings.folder / f"{name}.json").read_text())


def versions() -> dict[str, str]:
    """Of Python and of everything that has a part in the numbers."""
    return {"python": platform.python_version()} | {package: version(package) for package in _PACKAGES}


def plain(value: Any) -> Any:
    """Numbers, arrays and containers as JSON has them: six digits, null for what is not finite."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(item) for item in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{_DIGITS}g}") if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
