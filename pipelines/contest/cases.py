"""Who takes part, and where."""

from __future__ import annotations

from dataclasses import dataclass

AGENTS = (
    "random", "drift", "lawnmower", "gradient", "greedy_information", "sarsa_lambda",
    "true_online_sarsa_lambda", "informed_sarsa_lambda", "planner", "oracle",
)  # fmt: skip
LEARNERS = ("sarsa_lambda", "true_online_sarsa_lambda", "informed_sarsa_lambda")
COMMON = (
    "scenario=drawn", "reward=information_gain", "estimator=least_squares", "steps=20",
    "cross_validation=as_needed",
)  # fmt: skip
"""Of every case: truths drawn anew, one budget, one estimator, so that only the choice of samples differs."""


@dataclass(frozen=True)
class Place:
    """Where a contest is held.

    Args:
        experiment: an option of the group.
        start: where the vehicle begins, in words of the table.
        plume: where the feature begins.
        overrides: what makes it so.
        share: of a scale's test missions that are held here.
    """

    experiment: str
    start: str
    plume: str
    overrides: tuple[str, ...]
    share: float = 1.0


def _near(start: str, plume: str) -> Place:
    truths = ("scenario.lower=[0,0]", "scenario.upper=[8,8]")
    place = (f"vehicle.start={start}", f"pde.initial.centre={plume}")
    return Place("advection", start, plume, (*truths, *place))


def _far(start: str) -> Place:
    return Place("search", start, "drawn", (f"vehicle.start={start}",))


def _gyre(start: str) -> Place:
    """Truths are of the reduced model that is fitted: thousands of episodes with full solves take hours."""
    water = ("pde=reduced_double_gyre", "pde.reduced_truth=true", "pde.truth_refinement=1")
    return Place("double_gyre", start, "[60,40]", (*water, f"vehicle.start={start}", "steps=10"), 1 / 5)


PLACES = (
    _near("[20,20]", "[50,50]"),
    _near("[100,20]", "[60,60]"),
    _far("[30,150]"),
    _far("[30,60]"),
    _gyre("[60,40]"),
    _gyre("[150,60]"),
)


@dataclass(frozen=True)
class Scale:
    """How much is computed.

    Args:
        places: where.
        seeds: test missions of each agent at a place, or a place's share of them: where planning is dear.
        episodes: that a learner trains.
    """

    places: tuple[Place, ...]
    seeds: int
    episodes: int

    def missions(self, place: Place) -> int:
        """Test missions of each agent at a place."""
        return round(self.seeds * place.share)


SCALES = {
    "paper": Scale(PLACES, 250, 10_000),
    "small": Scale((PLACES[0], PLACES[2]), 10, 300),
}


def configuration(place: Place, agent: str, episodes: int) -> tuple[str, ...]:
    """The overrides of a case."""
    sees = "informed" if agent == "informed_sarsa_lambda" else "paper"
    budget = (f"episodes={episodes if agent in LEARNERS else 1}", "evaluation_episodes=0", "replicates=1")
    chosen = (f"experiment={place.experiment}", f"agent={agent}", f"observation={sees}")
    return (*chosen, *COMMON, *place.overrides, *budget)
