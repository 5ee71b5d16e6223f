"""The report of a run, from made-up results."""

from __future__ import annotations

from html.parser import HTMLParser

import xarray as xr

from fieldrl.runs import run_page

SUMMARY = {
    "experiment": "advection",
    "key": "0123456789",
    "parameters": {"b_x": {"true": 5.0, "estimate": 5.1, "interval": [4.9, 5.3], "unit": "length/time"}},
    "pooled": {"parameters": {"b_x": {"estimate": 5.01, "interval": [4.99, 5.03]}}},
    **{"best_episode": 2, "episodes": 10, "steps": 10, "replicates": 1, "seed": 0},
    **{"e_f": 1.0, "e_cv": 1.0, "e_total": 2.0, "theta_error": 0.01, "field_rmse": 0.5},
}


class Addresses(HTMLParser):
    """Everything that a page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.found += [value for name, value in attrs if name in ("src", "href") and value]


def test_a_report_holds_result_pictures_and_command_in_one_file(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "path.png").write_bytes(b"picture")
    (tmp_path / ".hydra").mkdir()
    (tmp_path / ".hydra" / "config.yaml").write_text("seed: 0\n")

    page = run_page.page(xr.Dataset(), SUMMARY, tmp_path, "advection <i>", "fieldrl seed=3", {"seed": "3"})

    addresses = Addresses()
    addresses.feed(page)
    assert addresses.found == ["data:image/png;base64,cGljdHVyZQ=="]
    assert "All 100 samples give b_x = 5.010 ± 0.020 length/time (95 %)." in page
    assert "advection &lt;i&gt;" in page
    assert "<td>seed</td><td>3</td>" in page
    assert "<pre>fieldrl seed=3</pre>" in page
    assert 'id="course"' not in page


def test_pictures_are_in_the_order_of_the_page_and_unknown_ones_last(tmp_path):
    for name in ("another_one", "learning_curve", "course"):
        (tmp_path / f"{name}.png").write_bytes(b"")

    assert [one.heading for one in run_page.pictures(tmp_path)] == [
        "The best episode, sample by sample",
        "Learning",
        "Another one",
    ]
