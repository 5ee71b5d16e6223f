"""The page on made-up claims, and what a claim says of itself."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fieldrl.core.checks import FieldrlError
from pipelines import artefacts, measures
from pipelines.experiments import Settings
from pipelines.paper import claims, page, readme, rules
from pipelines.paper.claim import Claim
from pipelines.paper.rules import RULES


def made_up(**hypotheses: tuple[bool, ...]) -> Claim:
    findings = {
        name.replace("_", " "): [rules.fact(f"thing {i}", "1 [0, 2]", holds) for i, holds in enumerate(every)]
        for name, every in hypotheses.items()
    }
    return Claim("Name", "section 5", "b < c & d", findings, "Because.", "8 replicates")


def note(*made: Claim) -> dict:
    described = claims.judged(list(made))
    return {"numbers": {"claims": described}, "rules": RULES, "runs": [], "versions": {"fieldrl": "1"}}


def test_every_hypothesis_has_its_own_verdict_and_nothing_is_blended():
    claim = claims.judged([made_up(one_start=(True, True), global_fits=(True, False))])[0]
    assert [each["verdict"] for each in claim["hypotheses"]] == ["reproduced", "not reproduced"]
    assert [f["outcome"] for f in claim["hypotheses"][1]["findings"]] == ["confirmed", "refuted"]


def test_findings_keep_their_claims_when_all_are_judged_together():
    first, second = claims.judged([made_up(a=(True,)), made_up(a=(False, True), b=(True,))])
    assert [each["verdict"] for each in first["hypotheses"]] == ["reproduced"]
    assert [each["verdict"] for each in second["hypotheses"]] == ["not reproduced", "reproduced"]


def test_the_page_shows_every_claim_with_its_verdict_rules_and_escapes_text():
    text = page.render(note(made_up(a=(True,)), made_up(a=(False,), b=(True,))), [], "paper")
    assert text.count('<td class="claim">') == 2
    assert "b &lt; c &amp; d" in text
    assert 'class="badge reproduced"' in text
    assert 'class="badge not-reproduced"' in text
    assert all(rule.split(";")[0][:40] in text for rule in RULES.values())
    assert "<script" not in text
    assert "http" not in text


def test_the_small_scale_is_marked_as_such():
    assert "small scale" in page.render(note(made_up(a=(True,))), [], "small")
    assert "small scale" not in page.render(note(made_up(a=(True,))), [], "paper")


def test_a_page_without_its_parts_is_refused(tmp_path):
    with pytest.raises(FieldrlError, match=r"figure_2.*missing; python -m pipelines\.paper"):
        page.make(Settings(output_dir=str(tmp_path)))


def test_the_markdown_tables_have_a_row_for_each_claim():
    described = note(made_up(one_start=(True,), b=(False,)), made_up(**{"": (False,)}))["numbers"]["claims"]
    lines = readme.table(described).splitlines()
    assert lines[2] == (
        "| b < c & d (section 5) | **reproduced**, one start<br>✓ thing 0: 1 [0, 2]"
        "<br>**not reproduced**, b<br>✗ thing 0: 1 [0, 2] |"
    )
    assert len(lines) == 4
    short = readme.short_table(described).splitlines()
    assert short[2:] == [
        "| b < c & d | one start: reproduced; b: not reproduced |",
        "| b < c & d | not reproduced |",
    ]


def test_a_table_is_put_between_the_marks_of_a_file():
    text = "before\n<!-- one: python -m pipelines.paper.readme -->\nold\n<!-- end of one -->\nafter"
    assert readme.replaced(text, "one", "new") == text.replace("old", "new")


def test_the_docs_have_a_place_for_every_table(tmp_path):
    settings, root = Settings(output_dir=str(tmp_path)), Path(__file__).parents[3]
    (tmp_path / "docs").mkdir()
    for name in ("README.md", "docs/paper.md", "docs/true-field.md"):
        (tmp_path / name).write_text((root / name).read_text())
    described = note(made_up(one_start=(True,)))
    artefacts.put(settings, "claims.json", json.dumps(described).encode())
    for name in readme._TABLES:
        artefacts.put(settings, f"{name}.md", f"new table of {name}".encode())
    readme.make(settings, tmp_path)
    for name, where in readme._TABLES.items():
        assert f"new table of {name}" in (tmp_path / "docs" / f"{where}.md").read_text()
    assert readme.table(described["numbers"]["claims"]) in (tmp_path / "docs/paper.md").read_text()


def test_early_and_late_episodes_are_an_eighth_and_a_quarter():
    values = np.arange(16.0).reshape(2, 8)
    np.testing.assert_array_equal(measures.early(values), [[0], [8]])
    np.testing.assert_array_equal(measures.late(values), [[6, 7], [14, 15]])


def test_level_sets_are_counted_by_the_change_of_the_samples():
    field = np.array([[[0.0, 50.0, 20.0]]])
    assert measures.crossed(field, 100.0).item() == pytest.approx(8)
    assert measures.followed(field).item() == pytest.approx(70 / 3)


def test_noise_alone_crosses_as_many_level_sets_as_the_docstring_says():
    noise = np.random.default_rng(0).normal(size=(4000, 20))
    assert measures.crossed(noise, 100.0).mean() == pytest.approx(2.1, abs=0.05)


def test_accuracy_parts_the_best_from_the_worst_tenth():
    theta = np.arange(20.0).reshape(1, 20, 1, 1)
    record = xr.Dataset(
        {"theta": (("replicate", "episode", "step", "parameter"), theta), "true": ("parameter", [0.0])}
    )
    worst, best = measures.by_accuracy(record, np.arange(20.0)[None])
    assert (worst.item(), best.item()) == (18.5, 0.5)
