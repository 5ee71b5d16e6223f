"""A run on one page: ``report.html``, a single file with everything in it."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fieldrl.runs import meaning, title
from fieldrl.runs.folder import text

if TYPE_CHECKING:
    import xarray as xr
    from markupsafe import Markup

_FIGURES = {
    "course": (
        "The best episode, sample by sample",
        "The true field at the time of each sample (ring), and the path up to it.",
    ),
    "path": (
        "Paths",
        "The first, the best and the last episode over the true field at the final time. The field drifts: "
        "what a path met on its way shows above.",
    ),
    "learning_curve": ("Learning", "Return and total error of every episode."),
    "field_error": ("The field", "True and estimated field at the final time, and their difference."),
    "field_std": (
        "How well the field is known",
        "Standard deviation of the estimated field at the final time, by the fields that fit the samples.",
    ),
    "regions": (
        "What the samples tell together",
        "Joint regions of the unknowns that hold the truth with 50 and 95 %, about every solution that fits.",
    ),
    "samples_used": ("Samples used", "How many each episode took until its intervals were narrow enough."),
    "convergence": (
        "Convergence of the fits",
        "Regret of each fit, its best loss so far over the least that it finds, against its forward solves. "
        "Fits that start from known solves begin at their best.",
    ),
    "samples": (
        "The samples",
        "Where they were taken, over the estimated field at the time of the last one.",
    ),
    "residuals": (
        "Residuals",
        "Prediction minus value along time, against the noise: where the model is right they scatter evenly.",
    ),
    "fit": ("The fit", "Prediction against value."),
}
"""Heading and caption of each picture, in the order of the page."""


@dataclass(frozen=True)
class Picture:
    """A picture within a page.

    Args:
        heading: above it.
        caption: beneath it.
        source: a data address that holds it.
    """

    heading: str
    caption: str
    source: str

    @classmethod
    def of(cls, path: Path) -> Picture:
        """A PNG file; one that is not known by name has its name as heading."""
        heading, caption = _FIGURES.get(path.stem, (path.stem.replace("_", " ").capitalize(), ""))
        return cls.drawn(path.read_bytes(), heading, caption)

    @classmethod
    def drawn(cls, png: bytes, heading: str, caption: str = "") -> Picture:
        """The content of a PNG file."""
        return cls(heading, caption, f"data:image/png;base64,{base64.b64encode(png).decode()}")


def page(
    record: xr.Dataset,
    summary: Mapping[str, Any],
    folder: Path,
    name: str,
    command: str,
    changed: Mapping[str, str],
) -> str:
    """The report of a run.

    Args:
        record: the run's record.
        summary: its result.
        folder: where its pictures and its configuration are.
        name: what people call it.
        command: the command line that gives the same.
        changed: value by key of what differs from the experiment.

    Returns:
        HTML.
    """
    from fieldrl.figures.course import has_course
    from fieldrl.figures.moving import moving_course

    titles, rows = meaning.result_rows(summary)
    return render(
        "report",
        name=name,
        question=title.about(summary["experiment"])[0],
        sentences=meaning.sentences(summary),
        titles=titles,
        rows=rows,
        course=_embedded(moving_course(record)) if has_course(record) else "",
        pictures=pictures(folder / "figures"),
        changed=changed,
        configuration=text(folder / ".hydra" / "config.yaml"),
        provenance=_provenance(summary),
        command=command,
    )


def pictures(folder: Path) -> list[Picture]:
    """The pictures of a folder, in the order of the page."""
    order = list(_FIGURES)
    paths = sorted(
        folder.glob("*.png"),
        key=lambda path: (order.index(path.stem) if path.stem in order else len(order), path.stem),
    )
    return [Picture.of(path) for path in paths]


def render(template: str, **content: Any) -> str:
    """Fill the template of this name beside this file."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(f"{template}.html.jinja").render(**content) + "\n"


def _provenance(summary: Mapping[str, Any]) -> dict[str, str]:
    names = {
        "key": "key", "version": "version of fieldrl", "seed": "seed", "replicates": "replicates",
        "episodes": "episodes", "steps": "samples of an episode", "seconds": "time [s]",
        "record": "checksum of the record",
    }  # fmt: skip
    return {text: str(summary[name]) for name, text in names.items() if name in summary}


def _embedded(content: Mapping[str, Any]) -> Markup:
    """JSON that cannot end the element it stands in."""
    from markupsafe import Markup

    return Markup(json.dumps(content).replace("<", "\\u003c"))
