"""The page: outputs/paper/index.html, one file that needs no other, from what the pipelines have left.

python -m pipelines.paper.page [scale=small]      after python -m pipelines.paper

Takes seconds.
"""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from PIL import Image

from fieldrl.core.checks import FieldrlError
from pipelines import artefacts, experiments
from pipelines.experiments import Settings
from pipelines.paper.rules import Outcome, Verdict

FIGURES = (
    "figure_2", "figure_3_single_start", "figure_3_global", "learning", "figure_4", "figure_4d", "table_1",
    "figure_5", "animation", "figure_6", "table_2", "convergence", "landscape",
)  # fmt: skip
"""In the order of the page."""

MARKS = {Outcome.YES: "✓", Outcome.NO: "✗", Outcome.OPEN: "?", Outcome.UNSAID: "·"}
"""Beside each finding, on the page and in the docs."""
_WIDTH = 1000  # of the widest picture [pixel]


def make(settings: Settings) -> Path:
    """Write the page; returns its path. Raises FieldrlError where a part is missing."""
    missing = [name for name in (*FIGURES, "claims") if not (settings.folder / f"{name}.json").exists()]
    if missing:
        raise FieldrlError(
            f"{settings.folder}: {', '.join(missing)} missing; python -m pipelines.paper makes all"
        )
    claims = artefacts.read(settings, "claims")
    figures = [_figure(settings, name) for name in FIGURES]
    content = render(claims, figures, settings.scale)
    return artefacts.put(settings, "index.html", content.encode())


def render(claims: dict[str, Any], figures: Sequence[dict[str, Any]], scale: str) -> str:
    """The page's text.

    Args:
        claims: content of claims.json.
        figures: contents of the figures' JSON with their pictures.
        scale: of the runs.
    """
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["tight"] = lambda text: text.replace(" [", "\u00a0[").replace(", ", ",\u00a0")
    environment.filters["slug"] = lambda text: text.replace(" ", "-")
    counted = Counter(
        each["verdict"] for claim in claims["numbers"]["claims"] for each in claim["hypotheses"]
    )
    runs = {run["key"]: run for figure in (claims, *figures) for run in figure["runs"]}
    return environment.get_template("page.html.jinja").render(
        claims=claims["numbers"]["claims"],
        rules=claims["rules"],
        marks={outcome.value: mark for outcome, mark in MARKS.items()},
        tally=[(verdict.value, counted[verdict.value]) for verdict in Verdict],
        figures=figures,
        runs=sorted(runs.values(), key=lambda run: run["command"]),
        versions=claims["versions"],
        command="make paper" if scale == "paper" else f"python -m pipelines.paper scale={scale}",
        scale=scale,
    )


def _figure(settings: Settings, name: str) -> dict[str, Any]:
    """The JSON of a picture with the picture itself, the moving one where there is one."""
    note = artefacts.read(settings, name)
    path = settings.folder / note.get("moving", f"{name}.png")
    with Image.open(path) as image:
        width = min(_WIDTH, image.width)
    content = base64.b64encode(path.read_bytes()).decode()
    return note | {"kind": path.suffix[1:], "content": content, "width": width}


if __name__ == "__main__":
    experiments.command(make)
