"""Several runs side by side, from made-up results."""

from __future__ import annotations

from fieldrl.runs import comparison
from fieldrl.runs.folder import Run
from fieldrl.runs.inventory import Found


def found(tmp_path, key: str, late: list[float], *overrides: str) -> Found:
    summary = {
        "parameters": {"mu": {"true": 0.25, "estimate": 0.24, "unit": "1"}},
        "pooled": {"parameters": {"mu": {"estimate": 0.2497, "interval": [0.2490, 0.2504]}}},
        **{"best_episode": 2, "episodes": 10, "steps": 10, "replicates": 1, "late_e_total": late},
        **{"e_total": 1.5, "theta_error": 0.01},
    }
    return Found(Run("gyre", key, tmp_path), summary, ("experiment=gyre", *overrides))


def test_runs_differ_in_what_was_asked_for_differently(tmp_path):
    runs = [found(tmp_path, "a", [2.0], "seed=1", "episodes=5"), found(tmp_path, "b", [1.0], "episodes=5")]

    assert comparison.differing(runs) == ["seed"]


def test_the_best_run_is_first_and_every_key_has_its_effect(tmp_path):
    runs = [
        found(tmp_path, "a", [3.0, 5.0, 4.0], "agent=random", "seed=0"),
        found(tmp_path, "b", [2.0], "agent=random", "seed=1"),
        found(tmp_path, "c", [1.0], "agent=lawnmower", "seed=0"),
    ]

    page = comparison.page(runs, "three", "fieldrl report a b c")

    assert "Of 3 runs, gyre lawnmower seed=0 has the least total error" in page
    order = [page.index(f'<td class="key">{name}</td><td class="key">{seed}</td>') for name, seed in
             (("lawnmower", 0), ("random", 1), ("random", 0))]  # fmt: skip
    assert order == sorted(order)
    assert "<td>random</td><td>2</td><td>3 [2.5, 3.5]</td>" in page
    assert page.count("data:image/png;base64,") == 1  # the effect of the agent; the seed has none
    assert "0.24970 ± 0.00070" in page


def test_one_run_alone_is_named(tmp_path):
    page = comparison.page([found(tmp_path, "a", [2.0], "seed=1")], "one", "fieldrl report a")

    assert '<td class="key">gyre seed=1</td>' in page
