"""Every claim of the paper's results section, beside what was measured, with a verdict by rule.

python -m pipelines.paper.claims [scale=small]

Where the paper leaves open which of two things it did, each is a hypothesis with its own verdict.

Takes seconds, and its runs an hour and a half.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pipelines import artefacts, experiments
from pipelines.experiments import Found, Settings, Wanted
from pipelines.paper import (
    claims_advection,
    claims_behaviour,
    claims_diffusion,
    claims_gyres,
    companions,
    gyres,
    rules,
    variations,
)
from pipelines.paper.claim import Claim
from pipelines.paper.rules import RULES, Judged

_PARTS: tuple[Callable[[Settings, Mapping[str, Found]], list[Claim]], ...] = (
    claims_behaviour.informative,
    claims_advection.claims,
    claims_behaviour.paths,
    claims_gyres.claims,
    claims_behaviour.following,
    claims_diffusion.claims,
)


def plan(settings: Settings) -> dict[str, Wanted]:
    """All runs that a claim is judged by."""
    return {
        **variations.compared(settings),
        **gyres.PLAN,
        **companions.plan(settings),
    }


def make(settings: Settings) -> list[dict[str, Any]]:
    """Find the runs, judge every claim, write claims.json; returns the claims as they stand there."""
    runs = experiments.find(plan(settings), settings)
    claims = judged([claim for part in _PARTS for claim in part(settings, runs)])
    heading = {"caption": "Claims of the paper's results section.", "rules": RULES}
    artefacts.note(settings, "claims", heading, runs.values(), {"claims": claims})
    return claims


def judged(claims: list[Claim]) -> list[dict[str, Any]]:
    """Claims with their verdicts, as plain values; all findings are corrected for their number together."""
    findings = [each for claim in claims for found in claim.hypotheses.values() for each in found]
    outcomes = iter(rules.judge(findings))
    return [
        _described(claim, {name: [next(outcomes) for _ in found] for name, found in claim.hypotheses.items()})
        for claim in claims
    ]


def _described(claim: Claim, hypotheses: dict[str, list[Judged]]) -> dict[str, Any]:
    """A claim for claims.json."""
    tested = [
        {
            "name": name,
            "verdict": rules.verdict([each.outcome for each in found]).value,
            "findings": [_finding(each) for each in found],
        }
        for name, found in hypotheses.items()
    ]
    return {
        "name": claim.name, "where": claim.where, "text": claim.text, "why": claim.why,
        "replicates": claim.replicates, "hypotheses": tested,
    }  # fmt: skip


def _finding(judged: Judged) -> dict[str, Any]:
    finding = judged.finding
    return {
        "label": finding.label, "measured": judged.measured, "rule": finding.rule,
        "outcome": judged.outcome.value, "p_so": judged.so, "p_not_so": judged.not_so,
        "smallest": judged.smallest, **finding.numbers,
    }  # fmt: skip


if __name__ == "__main__":
    experiments.command(make)
