"""Hooks of the documentation's site: the command's help and the options' files become a page."""

from __future__ import annotations

from fieldrl.cli import help as command_help
from fieldrl.runs.options import directory, options


def on_page_markdown(markdown: str, **_: object) -> str:
    """Fill ``<!-- help -->`` and ``<!-- options -->``."""
    if "<!-- help -->" in markdown:
        text = command_help.text().replace(str(directory()), "conf")
        markdown = markdown.replace("<!-- help -->", _block(text, "text"))
    return markdown.replace("<!-- options -->", _options()) if "<!-- options -->" in markdown else markdown


def _options() -> str:
    """Every group with its options' files."""
    parts = [f"## The top\n\n{_block((directory() / 'config.yaml').read_text(), 'yaml')}"]
    for group in sorted(path for path in directory().iterdir() if path.is_dir()):
        names = options(group.name)
        if names:
            parts.append(f"## {group.name}")
        for name in names:
            text = (group / f"{name}.yaml").read_text()
            parts.append(f"### {group.name}={name}\n\n{_block(text, 'yaml')}")
    return "\n\n".join(parts)


def _block(text: str, language: str) -> str:
    return f"```{language}\n{text.rstrip()}\n```"
