"""The calibration, small: its tables, its picture, its numbers."""

from __future__ import annotations

import json

import pytest

from pipelines.calibration import __main__ as calibration
from pipelines.experiments import Settings


@pytest.mark.slow
def test_tables_picture_and_numbers_agree(tmp_path, capsys):
    settings = Settings(scale="small", output_dir=str(tmp_path), jobs=1)
    note = calibration.make(settings)
    folder = tmp_path / "calibration" / "small"
    assert (folder / "calibration.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((folder / "calibration.json").read_text())["command"] == note["command"]
    text = (folder / "tables.md").read_text()
    for table in note["tables"].values():
        assert table["title"] in text
        for row in table["rows"]:
            assert f"| {' | '.join(row)} |" in text
    coverage = note["tables"]["coverage"]["rows"]
    assert [row[:3] for row in coverage[:2]] == [("advection", "3", "6"), ("advection", "5", "6")]
    assert "Coverage of intervals" in capsys.readouterr().out
