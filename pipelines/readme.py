"""Bring the claims and the picture in README.md and docs/paper.md up to date with outputs/paper.

python -m pipelines.readme      after make paper
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PIL import Image

from pipelines import artefacts, experiments
from pipelines.experiments import Settings

_BEGIN, _END = "<!-- claims: python -m pipelines.readme -->", "<!-- end of claims -->"
_FEW = 5  # rows in README.md
_PICTURE, _WIDTH, _COLOURS = "learning", 1100, 256


def make(settings: Settings, root: Path = Path()) -> None:
    """Rewrite the marked parts of both files and the picture.

    Args:
        settings: where the page's parts are.
        root: of the repository.
    """
    claims = artefacts.read(settings, "claims")["numbers"]["claims"]
    for name, rows in (("README.md", claims[:_FEW]), ("docs/paper.md", claims)):
        path = root / name
        path.write_text(replaced(path.read_text(), table(rows)))
    with Image.open(settings.folder / f"{_PICTURE}.png") as image:
        small = image.convert("RGB").resize((_WIDTH, round(image.height * _WIDTH / image.width)))
    target = root / "docs" / "images" / f"{_PICTURE}.png"
    small.quantize(_COLOURS, dither=Image.Dither.NONE).save(target, optimize=True)


def table(claims: list[dict[str, Any]]) -> str:
    """The claims as a Markdown table: claim, findings, verdict."""
    rows = ["| the paper | measured: median [quartiles] | verdict |", "|---|---|---|"]
    for claim in claims:
        findings = "<br>".join(f"{each['label']}: {each['measured']}" for each in claim["findings"])
        text = f"{claim['text']} ({claim['where']})"
        rows.append(
            " | ".join(
                cell.replace("|", "\\|") for cell in ("", text, findings, claim["verdict"], "")
            ).strip()
        )
    return "\n".join(rows)


def replaced(text: str, content: str) -> str:
    """``text`` with ``content`` between its two marks; ValueError where they are missing."""
    head, rest = text.split(_BEGIN, 1)
    _, tail = rest.split(_END, 1)
    return f"{head}{_BEGIN}\n{content}\n{_END}{tail}"


if __name__ == "__main__":
    experiments.command(make)
