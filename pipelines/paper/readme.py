"""Bring the tables and pictures in README.md, docs/paper.md and docs/true-field.md up to outputs/paper.

python -m pipelines.paper.readme      after make paper; README.md has the verdicts of three telling claims

Takes seconds.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PIL import Image

from pipelines import artefacts, experiments
from pipelines.experiments import Settings
from pipelines.paper.page import MARKS
from pipelines.paper.rules import Outcome

_COMMAND = "python -m pipelines.paper.readme"
_TELLING = ("Informative samples", "Total error at the end", "Learned mu")  # claims in README.md
_TABLES = {
    "inverse_crime": "true-field",
    "position_errors_advection": "true-field",
    "position_errors_double_gyre": "true-field",
    "figure_3_settings": "paper",
    "figure_3_search": "paper",
}  # and the page of docs/ that they are in
_PICTURES, _WIDTH, _COLOURS = ("learning", "figure_3_search"), 1100, 256


def make(settings: Settings, root: Path = Path()) -> None:
    """Rewrite the marked parts of the files and the pictures; what has not been computed stays as it is.

    Args:
        settings: where the page's parts are.
        root: of the repository.
    """
    if (settings.folder / "claims.json").exists():
        claims = artefacts.read(settings, "claims")["numbers"]["claims"]
        telling = [claim for name in _TELLING for claim in claims if claim["name"] == name]
        _rewrite(root / "README.md", "claims", short_table(telling))
        _rewrite(root / "docs" / "paper.md", "claims", table(claims))
    for name, page in _TABLES.items():
        made = settings.folder / f"{name}.md"
        if made.exists():
            _rewrite(root / "docs" / f"{page}.md", name, made.read_text().strip())
    for name in _PICTURES:
        picture = settings.folder / f"{name}.png"
        if picture.exists():
            shrink(picture, root / "docs" / "images" / picture.name)


def table(claims: list[dict[str, Any]]) -> str:
    """The claims as a Markdown table: claim, and every hypothesis with its verdict and findings."""
    rows = ["| the paper | verdict, and what was measured |", "|---|---|"]
    for claim in claims:
        tested = "<br>".join(_tested(each) for each in claim["hypotheses"])
        rows.append(_row(f"{claim['text']} ({claim['where']})", tested))
    return "\n".join(rows)


def short_table(claims: list[dict[str, Any]]) -> str:
    """The claims with the verdict of every hypothesis alone."""
    rows = ["| the paper | verdict |", "|---|---|"]
    for claim in claims:
        verdicts = "; ".join(
            f"{each['name']}: {each['verdict']}".removeprefix(": ") for each in claim["hypotheses"]
        )
        rows.append(_row(claim["text"], verdicts))
    return "\n".join(rows)


def _tested(hypothesis: dict[str, Any]) -> str:
    head = f"**{hypothesis['verdict']}**" + (f", {hypothesis['name']}" if hypothesis["name"] else "")
    findings = (
        f"{MARKS[Outcome(each['outcome'])]} {each['label']}: {each['measured']}"
        for each in hypothesis["findings"]
    )
    return "<br>".join([head, *findings])


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def replaced(text: str, name: str, content: str, command: str = _COMMAND) -> str:
    """``text`` with ``content`` between the two marks of a name; ValueError where they are missing."""
    begin, end = f"<!-- {name}: {command} -->", f"<!-- end of {name} -->"
    head, rest = text.split(begin, 1)
    _, tail = rest.split(end, 1)
    return f"{head}{begin}\n{content}\n{end}{tail}"


def _rewrite(path: Path, name: str, content: str) -> None:
    path.write_text(replaced(path.read_text(), name, content))


def shrink(picture: Path, target: Path) -> None:
    """The picture at the docs' width, in few colours."""
    with Image.open(picture) as image:
        small = image.convert("RGB").resize((_WIDTH, round(image.height * _WIDTH / image.width)))
    small.quantize(_COLOURS, dither=Image.Dither.NONE).save(target, optimize=True)


if __name__ == "__main__":
    experiments.command(make)
