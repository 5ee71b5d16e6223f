"""The paper's figures, small: what they leave, and that a second time nothing is computed."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import pytest
from matplotlib.figure import Figure
from PIL import Image

from pipelines import experiments
from pipelines.experiments import Settings
from pipelines.faults.fuzz_workers import without_figures
from pipelines.paper import animation, page
from pipelines.paper import listing as paper


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Settings:
    """Everything, made once."""
    settings = Settings(scale="small", output_dir=str(tmp_path_factory.mktemp("outputs")), jobs=1)
    with without_figures():  # those of each run; the paper's are drawn
        paper.make(settings)
    return settings


def notes(settings: Settings) -> dict[str, bytes]:
    return {path.stem: path.read_bytes() for path in settings.folder.glob("*.json")}


@pytest.mark.slow
def test_every_figure_is_a_pdf_and_a_png_with_a_json_beside_them(made):
    assert notes(made).keys() == {*page.FIGURES, "claims"}
    for name in page.FIGURES:
        assert (made.folder / f"{name}.pdf").read_bytes().startswith(b"%PDF")
        assert (made.folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_json_names_runs_versions_numbers_and_the_command(made):
    for name, content in notes(made).items():
        note = json.loads(content)
        assert note["command"].startswith("python -m pipelines."), name
        assert note["versions"]["numpy"]
        assert note["numbers"]
        for run in note["runs"]:
            assert (made.folder.parent / "runs" / run["key"] / "record.nc").exists()


@pytest.mark.slow
def test_a_second_time_nothing_is_computed_and_every_json_has_the_same_bytes(made, monkeypatch, tmp_path):
    before = notes(made)
    again = replace(made, output_dir=str(shutil.copytree(made.output_dir, tmp_path / "outputs")))
    monkeypatch.setattr(experiments, "performed", None)
    monkeypatch.setattr(Figure, "savefig", lambda *_, **__: None)  # the numbers are what is asked for
    monkeypatch.setattr(animation, "picture", lambda *_, **__: Image.new("RGB", (2, 2)))
    for pipeline in paper.PIPELINES:
        pipeline.make(again)
    assert notes(again) == before


@pytest.mark.slow
def test_the_page_is_one_file_with_every_claim_and_every_picture(made):
    text = (made.folder / "index.html").read_text()
    claims = json.loads(notes(made)["claims"])["numbers"]["claims"]
    assert len(claims) == 20
    assert text.count('<td class="claim">') == len(claims)
    assert text.count("data:image/png;base64,") == len(page.FIGURES) - 1
    assert text.count("data:image/gif;base64,") == 1
    assert 'src="http' not in text
    for run in json.loads(notes(made)["claims"])["runs"]:
        assert run["key"] in text


@pytest.mark.slow
def test_the_animation_is_a_gif_that_moves(made):
    with Image.open(made.folder / "animation.gif") as animation:
        assert animation.n_frames > 1
