"""SARSA(lambda) with tile coding: Algorithm 1 of the paper, and its two sisters.

| symbol | meaning | shape | unit |
|---|---|---|---|
| alpha | step size of each tiling, step_size / tilings | scalar | - |
| lambda | trace decay | scalar | - |
| gamma | discount | scalar | - |
| epsilon | exploration | scalar | - |
| w, z | weights, eligibility traces | (actions, features) | reward, - |

Line 10 of Algorithm 1, z_i <- 1 for the active features, makes *replacing* traces, the default.
*Accumulating* traces add 1 instead, Eq. (25). *Dutch* traces add 1 - alpha z'x, and the update corrects
for the change of the weights since the last step: true online SARSA(lambda) (van Seijen et al. 2016;
Sutton & Barto 2018, section 12.7), which equals the online forward view exactly.

A trace that has decayed below 1e-10 counts as zero, so that an update touches only what is eligible.
"""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from fieldrl.agent import kernels
from fieldrl.agent.schedules import Schedule
from fieldrl.agent.tile_coding import TileCoding
from fieldrl.core import checks
from fieldrl.core.cost import DOUBLE, Cost, Extent
from fieldrl.core.kinds import component

TRACES = ("replacing", "accumulating", "dutch")
State = dict[str, NDArray]
_STEP, _FEATURE = 2e-5, 2e-9  # time of a step, and of a feature that is traced in it [s]


class LearningDiverged(checks.FieldrlError, ArithmeticError):
    """The value estimates are no longer finite.

    Args:
        episode: episodes begun so far.
        error: the estimation error delta of the last update.
    """

    def __init__(self, episode: int, error: float) -> None:
        super().__init__(episode, error)
        self.episode, self.error = episode, error

    def __str__(self) -> str:
        return (
            f"learning diverged in episode {self.episode} (estimation error {self.error}); "
            "lower agent.step_size or agent.trace_decay, or use agent.traces=replacing"
        )


@component
class SarsaLambda:
    """SARSA(lambda), Algorithm 1, epsilon-greedy with ties broken at random.

    Args:
        step_size: the share of the error that one visit removes, in (0, 1]; divided by the tilings.
        trace_decay: lambda in [0, 1].
        discount: gamma in [0, 1].
        exploration: epsilon in [0, 1], the probability of an action drawn from all of them.
        traces: "replacing", "accumulating" or "dutch".
        tile_coding: the features.
        step_size_schedule: how the step size changes with the episodes, or None.
        exploration_schedule: how epsilon does, or None.
        initial_value: of every action before anything is learned; more than any policy returns is optimistic
            (Sutton & Barto 2018, section 2.6): the agent tries everything.
    """

    step_size: float = 0.9
    trace_decay: float = 0.9
    discount: float = 1.0
    exploration: float = 0.15
    traces: str = "replacing"
    tile_coding: TileCoding = field(default_factory=TileCoding)
    step_size_schedule: Schedule | None = None
    exploration_schedule: Schedule | None = None
    initial_value: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < checks.number("step_size", self.step_size) <= 1:
            raise checks.InvalidValue("step_size", self.step_size, "must lie in (0, 1]")
        for name in ("trace_decay", "discount", "exploration"):
            object.__setattr__(self, name, checks.between(name, getattr(self, name), 0, 1))
        object.__setattr__(self, "step_size", float(self.step_size))
        checks.one_of("traces", self.traces, TRACES)
        _check_schedule("step_size_schedule", self.step_size_schedule)
        _check_schedule("exploration_schedule", self.exploration_schedule)

    def cost(self, extent: Extent) -> Cost:
        """Tables of weights, traces and eligible features, and their copy in a checkpoint."""
        table = extent.actions * self.tile_coding.features
        traced = min(extent.steps * self.tile_coding.tilings, table)
        by = ("tile_coding.tilings", "tile_coding.tiles")
        return Cost(6 * DOUBLE * table, extent.samples * (_STEP + _FEATURE * traced), by)

    def begin(self, low: NDArray[np.float64], high: NDArray[np.float64], actions: int) -> State:
        """The state of an agent that has seen nothing; the only allocation of its table.

        Args:
            low: least observation, (4,) [length, length, rad, time].
            high: greatest observation, (4,).
            actions: how many there are.

        Returns:
            Plain arrays: weights and traces (actions, features), eligible (actions * features,), the tile
            coder, and one number each (1,): eligible_count, previous_value, step_size (of a tiling),
            exploration, episode (begun so far).
        """
        table = (actions, self.tile_coding.features)
        try:
            coder = self.tile_coding.coder(low, high)
        except checks.InvalidValue as error:
            raise error.within("tile_coding") from None
        return {
            "weights": np.full(table, self.initial_value / self.tile_coding.tilings),
            "traces": np.zeros(table),
            "eligible": np.zeros(math.prod(table), dtype=np.int64),
            "eligible_count": np.zeros(1, dtype=np.int64),
            "previous_value": np.zeros(1),
            "step_size": np.array([self.step_size / self.tile_coding.tilings]),
            "exploration": np.array([self.exploration]),
            "episode": np.zeros(1, dtype=np.int64),
            "coder": coder,
        }

    def begin_episode(self, state: State) -> State:
        """The same state, ready for the next episode: traces zero (line 4), schedules advanced."""
        episode = int(state["episode"][0])
        kernels.forget(state["traces"], state["eligible"], state["eligible_count"])
        state["previous_value"][0] = 0.0
        step_size = _scheduled(self.step_size_schedule, self.step_size, episode)
        state["step_size"][0] = step_size / self.tile_coding.tilings
        state["exploration"][0] = _scheduled(self.exploration_schedule, self.exploration, episode)
        state["episode"][0] = episode + 1
        return state

    def act(
        self, state: State, observation: NDArray[np.float64], rng: np.random.Generator, greedy: bool = False
    ) -> int:
        """An action for the observation (4,); draws two uniform numbers, greedy or not."""
        exploration = 0.0 if greedy else state["exploration"].item()
        return kernels.choose(
            state["weights"], state["coder"], observation, exploration, rng.random(), rng.random()
        )

    def learn(
        self,
        state: State,
        observation: NDArray[np.float64],
        action: int,
        reward: float,
        next_observation: NDArray[np.float64],
        next_action: int,
        terminated: bool,
    ) -> State:
        """The state after one step of Algorithm 1, lines 7 to 18; its arrays are updated in place.

        Args:
            state: from ``begin_episode``.
            observation: s, (4,).
            action: a, taken in s.
            reward: r.
            next_observation: s', (4,).
            next_action: a', chosen in s'; not looked at where ``terminated``.
            terminated: does the episode end in s'?

        Raises:
            LearningDiverged: the values are no longer finite.
        """
        error = kernels.learn(
            state["weights"],
            state["traces"],
            state["eligible"],
            state["eligible_count"],
            state["previous_value"],
            state["step_size"],
            state["coder"],
            TRACES.index(self.traces),
            self.discount,
            self.discount * self.trace_decay,
            observation,
            int(action),
            float(reward),
            next_observation,
            int(next_action),
            bool(terminated),
        )
        if not math.isfinite(error):
            raise LearningDiverged(int(state["episode"][0]), error)
        return state


def _check_schedule(key: str, schedule: Schedule | None) -> None:
    """Raises InvalidValue unless ``schedule`` is None or ends at a value in [0, 1]."""
    if schedule is not None:
        checks.between(f"{key}.final", schedule.final, 0, 1)


def _scheduled(schedule: Schedule | None, initial: float, episode: int) -> float:
    return initial if schedule is None else schedule.value(initial, episode)
