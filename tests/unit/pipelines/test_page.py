"""The page on made-up claims, and what a claim says of itself."""

import numpy as np
import pytest
import xarray as xr

from fieldrl.core.checks import FieldrlError
from pipelines import claims, measures, page, readme
from pipelines.claims import Claim
from pipelines.experiments import Settings
from pipelines.rules import RULES, Finding, Outcome


def made_up(*outcomes: Outcome) -> Claim:
    findings = [Finding(f"thing {i}", "1 [0, 2]", outcome, "value") for i, outcome in enumerate(outcomes)]
    return Claim("Name", "section 5", "b < c & d", findings, "Because.", "8 replicates")


def note(*made: Claim) -> dict:
    described = [claims._described(claim) for claim in made]
    return {"numbers": {"claims": described}, "rules": RULES, "runs": [], "versions": {"fieldrl": "1"}}


def test_a_claim_counts_its_findings_and_says_why():
    claim = made_up(Outcome.YES, Outcome.YES, Outcome.NO)
    assert claim.verdict == "partly"
    assert claim.reason == "Of 3 findings 2 confirmed, 1 refuted. Because."
    assert made_up(Outcome.NO).reason == "Because."


def test_the_page_shows_every_claim_with_its_verdict_rules_and_escapes_text():
    text = page.render(note(made_up(Outcome.YES), made_up(Outcome.NO, Outcome.NO)), [], "paper")
    assert text.count('<td class="claim">') == 2
    assert "b &lt; c &amp; d" in text
    assert 'class="badge reproduced"' in text
    assert 'class="badge not-reproduced"' in text
    assert all(rule.split(";")[0][:40] in text for rule in RULES.values())
    assert "<script" not in text
    assert "http" not in text


def test_the_small_scale_is_marked_as_such():
    assert "small scale" in page.render(note(made_up(Outcome.YES)), [], "small")
    assert "small scale" not in page.render(note(made_up(Outcome.YES)), [], "paper")


def test_a_page_without_its_parts_is_refused(tmp_path):
    with pytest.raises(FieldrlError, match=r"figure_2.*missing; python -m pipelines\.paper"):
        page.make(Settings(output_dir=str(tmp_path)))


def test_the_markdown_table_has_a_row_for_each_claim_between_the_marks_of_a_file():
    described = note(made_up(Outcome.YES), made_up(Outcome.NO, Outcome.NO))["numbers"]["claims"]
    lines = readme.table(described).splitlines()
    assert lines[2] == "| b < c & d (section 5) | thing 0: 1 [0, 2] | reproduced |"
    assert len(lines) == 4
    text = f"before\n{readme._BEGIN}\nold\n{readme._END}\nafter"
    assert readme.replaced(text, "new") == text.replace("old", "new")


def test_early_and_late_episodes_are_an_eighth_and_a_quarter():
    values = np.arange(16.0).reshape(2, 8)
    np.testing.assert_array_equal(measures.early(values), [[0], [8]])
    np.testing.assert_array_equal(measures.late(values), [[6, 7], [14, 15]])


def test_level_sets_are_counted_by_the_change_of_the_samples():
    record = xr.Dataset({"value": (("replicate", "episode", "step"), [[[0.0, 50.0, 20.0]]])})
    assert measures.crossed(record, 100.0).item() == pytest.approx(8)
    assert measures.followed(record).item() == pytest.approx(70 / 3)


def test_accuracy_parts_the_best_from_the_worst_tenth():
    theta = np.arange(20.0).reshape(1, 20, 1, 1)
    record = xr.Dataset(
        {"theta": (("replicate", "episode", "step", "parameter"), theta), "true": ("parameter", [0.0])}
    )
    worst, best = measures.by_accuracy(record, np.arange(20.0)[None])
    assert (worst.item(), best.item()) == (18.5, 0.5)
