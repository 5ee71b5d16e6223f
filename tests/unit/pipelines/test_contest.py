"""The contest: missions, its page and its learning curve."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pipelines.contest import learning_curve, page
from pipelines.contest.cases import PLACES
from pipelines.contest.missions import COLUMNS, missions


@pytest.fixture(scope="module")
def table():
    parts = [
        missions(PLACES[2], agent, 1, 3, "outputs") for agent in ("random", "greedy_information", "oracle")
    ]
    return pd.concat(parts, ignore_index=True)


def test_agents_meet_the_same_truths_and_another_in_every_mission(table):
    first = table.pivot(index="seed", columns="agent", values="error_1")
    assert first["random"].nunique() == 3
    again = missions(PLACES[2], "random", 1, 3, "outputs")
    assert again["error_20"].tolist() == table[table["agent"] == "random"]["error_20"].tolist()


def test_the_error_after_the_last_sample_is_the_mission_s(table):
    assert np.array_equal(table["error_20"], table["parameter_error"])
    assert tuple(table) == (*COLUMNS, *(f"error_{sample}" for sample in range(1, 21)))


def test_the_page_shows_the_better_agent_first(table, tmp_path):
    page.write(table, tmp_path, 1, True)
    assert page.summary(table)[-1][0] == "random"
    oracle = page.relative(table).query("agent == 'oracle'")["parameter_error"]
    assert page.interquartile_mean(oracle.to_numpy()) == pytest.approx(1.0)
    assert {"index.html", "profiles.png", "by_sample.png"} == {path.name for path in tmp_path.iterdir()}
    assert page.course(table)["random"].shape == (3, 20)


def test_places_are_put_together_by_as_many_missions_of_each(table):
    fewer = table[table["seed"] < 2].assign(start="elsewhere")
    together = page.relative(pd.concat([table, fewer]))
    assert together.groupby(["start", "agent"])["seed"].nunique().tolist() == [2] * 6
    errors = page.scores(together, "parameter_error")
    assert errors["random"].shape == (2, 2)
    assert [page.interquartile_mean(row) for row in errors["oracle"]] == pytest.approx([1.0, 1.0])
    (ours,) = (row for row in page.summary(table) if row[0] == "random")
    own, oracle = (
        page.interquartile_mean(table[table["agent"] == name]["parameter_error"].to_numpy())
        for name in ("random", "oracle")
    )
    assert float(ours[2].split()[0]) == pytest.approx(own / oracle, rel=5e-3)


def _record(returns, estimate, truth):
    by_episode = {"return": (("replicate", "episode"), returns)}
    theta = np.broadcast_to(estimate, (len(returns), 4, 3, 2))
    tested = {
        "evaluation_theta": (("replicate", "evaluation_episode", "step", "parameter"), theta),
        "evaluation_truth": (
            ("replicate", "evaluation_episode", "parameter"),
            np.broadcast_to(truth, (len(returns), 4, 2)),
        ),
    }
    return xr.Dataset(by_episode | tested)


def test_a_rise_is_counted_in_the_width_over_replicates():
    course = np.repeat([0.0, 10.0], 10)
    returns = course + np.array([[-1.0], [0.0], [1.0]]) * (course > 0)
    found = learning_curve.measured(_record(returns, [3.0, 4.0], [0.0, 0.0]))
    assert (found["first"], found["last"], found["width"]) == (0.0, 10.0, 1.0)
    assert found["rise"] == 10.0
    assert found["error"] == 5.0
