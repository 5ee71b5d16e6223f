"""The diagnosis and the search behind figure 3, small: tables, pictures, numbers; then a look-up."""

from __future__ import annotations

import json

import pytest

from pipelines import experiments
from pipelines.diagnosis import __main__ as diagnosis
from pipelines.diagnosis import learners, returns
from pipelines.experiments import Settings
from pipelines.faults.fuzz_workers import without_figures
from pipelines.paper import figure_3_search, figure_3_settings


def refused(*_, **__):
    """In the place of what is not to be done again."""
    raise AssertionError("done again")


@pytest.mark.slow
def test_the_diagnosis_leaves_tables_pictures_and_numbers_and_is_not_done_twice(tmp_path, monkeypatch):
    settings = Settings(scale="small", output_dir=str(tmp_path), jobs=1)
    with without_figures():
        made = diagnosis.make(settings)
    folder = tmp_path / "diagnosis" / "small"
    note = json.loads((folder / "learning.json").read_text())
    text = (folder / "tables.md").read_text()
    assert [table.title for table in made] == [table["title"] for table in note["tables"]]
    assert all(f"| {' | '.join(row)} |" in text for table in made for row in table.rows)
    assert all(len(row) == len(table.columns) for table in made for row in table.rows)
    for name in ("learning", "values"):
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    for module, name in ((experiments, "performed"), (learners, "learned"), (returns, "play")):
        monkeypatch.setattr(module, name, refused)
    assert diagnosis.make(settings) == made


@pytest.mark.slow
def test_the_search_judges_with_other_noise_and_is_not_done_twice(tmp_path, monkeypatch):
    settings = Settings(scale="small", output_dir=str(tmp_path), jobs=1)
    found = figure_3_search.make(settings)
    note = json.loads((tmp_path / "paper" / "figure_3_search.json").read_text())
    assert [each["name"] for each in note["numbers"]["judged"]] == [each.name for each in found]
    assert len(note["numbers"]["searched"]) == 3
    table = (tmp_path / "paper" / "figure_3_search.md").read_text()
    assert all(f"| {' | '.join(row)} |" in table for row in figure_3_settings.rows_of(found))
    assert (tmp_path / "paper" / "figure_3_search.png").read_bytes().startswith(b"\x89PNG")
    monkeypatch.setattr(figure_3_settings, "curves_of", refused)
    assert figure_3_search.make(settings) == found
    named = figure_3_settings.make(settings)  # the same runs, judged without those of the search
    assert [each.measured for each in named] == [each.measured for each in found[:2]]
