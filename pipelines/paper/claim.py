"""A claim of the paper and what speaks for or against it."""

from __future__ import annotations

from dataclasses import dataclass

from pipelines.experiments import Found
from pipelines.paper.rules import Finding


@dataclass(frozen=True)
class Claim:
    """What the paper says, what was found, and why they agree or differ.

    Args:
        name: short, for the first column.
        where: place in the paper.
        text: what the paper says.
        hypotheses: findings by hypothesis; a single one has no name.
        why: a mechanism that explains the findings, in a sentence.
        replicates: how many the numbers come from, in words.
    """

    name: str
    where: str
    text: str
    hypotheses: dict[str, list[Finding]]
    why: str
    replicates: str


def counted(run: Found) -> str:
    """How many replicates and episodes a run has, in words."""
    sizes = run.record.sizes
    return f"{sizes['replicate']} replicates of {sizes['episode']} episodes"
