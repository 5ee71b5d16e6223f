"""Every claim of the paper's results section, beside what was measured, with a verdict by rule.

python -m pipelines.claims [scale=small]
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from pipelines import artefacts, claims_advection, claims_gyres, experiments, gyres, learning, variations
from pipelines.experiments import Settings, Wanted
from pipelines.rules import RULES, Finding, Outcome, verdict


@dataclass(frozen=True)
class Claim:
    """What the paper says, what was found, and why they agree or differ.

    Args:
        name: short, for the first column.
        where: place in the paper.
        text: what the paper says.
        findings: what was measured.
        why: a mechanism that explains the findings, in a sentence.
        replicates: how many the numbers come from, in words.
    """

    name: str
    where: str
    text: str
    findings: list[Finding]
    why: str
    replicates: str

    @property
    def verdict(self) -> str:
        """By the rule for all findings of a claim."""
        return verdict([finding.outcome for finding in self.findings]).value

    @property
    def reason(self) -> str:
        """How many findings speak for the claim, and the explanation."""
        if len(self.findings) == 1:
            return self.why
        counted = Counter(finding.outcome for finding in self.findings)
        said = ", ".join(
            f"{counted[outcome]} {text}" for outcome, text in _OUTCOMES.items() if counted[outcome]
        )
        return f"Of {len(self.findings)} findings {said}. {self.why}"


_OUTCOMES = {
    Outcome.YES: "confirmed",
    Outcome.PARTLY: "partly so",
    Outcome.NO: "refuted",
    Outcome.UNCLEAR: "unclear",
}


def plan(settings: Settings) -> dict[str, Wanted]:
    """All runs that a claim is judged by."""
    return {**variations.plan(settings), **learning.PLAN, **gyres.PLAN}


def make(settings: Settings) -> list[Claim]:
    """Find the runs, judge every claim, write claims.json."""
    runs = experiments.find(plan(settings), settings)
    parts = (*claims_advection.claims(settings, runs), *claims_gyres.claims(settings, runs))
    claims = [Claim(**each) for each in parts]
    heading = {"caption": "Claims of the paper's results section.", "rules": RULES}
    numbers = {"claims": [_described(claim) for claim in claims]}
    artefacts.note(settings, "claims", heading, runs.values(), numbers)
    return claims


def _described(claim: Claim) -> dict[str, Any]:
    findings = [
        {"label": f.label, "measured": f.measured, "outcome": f.outcome.value, "rule": f.rule}
        for f in claim.findings
    ]
    return {
        "name": claim.name, "where": claim.where, "text": claim.text, "verdict": claim.verdict,
        "reason": claim.reason, "replicates": claim.replicates, "findings": findings,
    }  # fmt: skip


if __name__ == "__main__":
    experiments.command(make)
