"""The search behind figure 3: its score, its space, and who is judged."""

from dataclasses import replace

import numpy as np
import pytest

from fieldrl.cli.compose import composed
from fieldrl.core.streams import stream
from fieldrl.runs.components import mission
from fieldrl.sweeps.proposals import propose
from pipelines.experiments import Settings
from pipelines.paper import figure_3_search as search
from pipelines.paper import figure_3_settings as judging
from pipelines.paper import figure_3_space as space
from pipelines.paper.figure_3_trends import TRENDS, VARIATIONS, Comparison, score, seeming, trends
from pipelines.paper.rules import Outcome

EPISODES = np.linspace(0.0, 1.0, 80)
ONE, OTHER = np.full(12, 10.0), np.full(12, 11.0)


def curves(as_the_paper):
    """Returns and errors of 12 replicates, (2, 12, 80) by variation: all trends, or noise alone."""
    rng, found = stream(0, "test"), {}
    worse = {"lambda 0.1": 10.0, "usual": 0.0, "alpha 0.1": -8.0}
    for name in VARIATIONS:
        noise = rng.normal(size=(2, 12, 80))
        shift = worse.get(name, 0.0) * as_the_paper
        rising = 10 * EPISODES * as_the_paper
        error = 2.0 + 0.05 * (shift + 10 * (1 - EPISODES) * as_the_paper)
        found[name] = np.stack([60 + rising - shift + noise[0], error + 0.01 * noise[1]])
    return found


def test_what_shows_every_trend_has_them_all_and_the_greatest_score():
    found = curves(True)
    found["alpha 0.1"][1] -= 0.2
    assert list(trends(found)) == list(TRENDS)
    assert all(seeming(found).values()), seeming(found)
    assert score(found) > 0.9


def test_noise_is_flat_and_near_2_and_shows_nothing_else():
    held = [name for name, holds in seeming(curves(False)).items() if holds]
    assert held == ["flat in epsilon", "error ends near 2"]
    assert score(curves(False)) < 0.5


@pytest.mark.parametrize(
    ("sign", "last", "margin", "seems"),
    [
        (1, 1.1 * ONE, 1.0, True),
        (1, 1.02 * ONE, 0.4, False),
        (-1, 1.02 * ONE, -0.4, False),
        (-1, 0.5 * ONE, 1.0, True),
        (0, 1.02 * ONE, 0.8, True),
        (0, 1.3 * ONE, -1.0, False),
    ],
)
def test_a_margin_is_a_share_of_what_counts(sign, last, margin, seems):
    found = Comparison("", sign, ONE, last)
    assert found.margin() == pytest.approx(margin)
    assert found.seems() is seems


def test_a_trend_is_judged_by_the_worst_of_its_comparisons():
    yes, no, unsure = Outcome.YES, Outcome.NO, Outcome.OPEN
    assert judging.together([yes, yes]) is yes
    assert judging.together([yes, unsure]) is unsure
    assert judging.together([no, unsure, yes]) is no


def test_every_setting_of_the_space_reaches_the_mission():
    points = [space.named(each) for each in space.NAMED.values()] + propose(space.SPACE, [], 6, 6, 0)
    for point in points:
        at = space.described(point)
        made = mission(composed(["experiment=advection", *space.overrides(point)]))
        assert made.vehicle.max_speed == float(at["v_max"])
        assert made.vehicle.start == (float(at["start x"]), float(at["start y"]))
        assert made.agent.initial_value == float(at["initial value"])
        assert made.agent.discount == float(at["gamma"])
        assert made.estimator.starts == int(at["starts"])
        assert made.water.parameters.upper[0] == float(at["bound"])


def test_the_shipped_point_is_the_shipped_experiment():
    shipped = mission(composed(["experiment=advection"]))
    point = mission(composed(["experiment=advection", *space.overrides(space.named(space.SHIPPED))]))
    assert replace(point, vehicle=shipped.vehicle) == shipped
    assert point.vehicle.turn == pytest.approx(shipped.vehicle.turn, abs=1e-6)
    assert replace(point.vehicle, turn=shipped.vehicle.turn) == shipped.vehicle


def test_the_best_and_the_named_are_judged():
    trials = [(point, loss) for point, loss in zip("abcdef", [3.0, 1.0, None, 2.0, 5.0, 0.5], strict=True)]
    found = search.chosen(trials, 2)
    assert list(found) == [*space.NAMED, "best 1", "best 2"]
    assert (found["best 1"], found["best 2"]) == ("f", "b")


def test_random_agents_of_two_variations_have_noise_of_their_own(tmp_path):
    settings = Settings(scale="small", output_dir=str(tmp_path), jobs=1)
    point = space.named(space.SHIPPED)
    task = judging.Task(point, "random", 0, 1)
    found = [judging.curves_of(task, variation, settings) for variation in VARIATIONS]
    assert {each.shape for each in found} == {(2, 1, 12)}
    assert len({each.tobytes() for each in found}) == len(VARIATIONS)
