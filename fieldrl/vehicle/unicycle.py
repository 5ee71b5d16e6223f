"""The vehicle: a unicycle that drifts with the flow, Eq. (9)-(12).

| symbol | meaning | shape | unit |
|---|---|---|---|
| state | x, y, heading phi (counter-clockwise from the x axis) | (3,) | length, length, rad |
| action | index into the seven rows of Eq. (12) | scalar | - |
| v_max | greatest forward speed | scalar | length/time |
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field
from functools import cached_property, lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from fieldrl.core import checks
from fieldrl.core.cost import Cost, Extent
from fieldrl.core.domain import Circle, Domain, Rectangle
from fieldrl.core.flow_adapter import adapted
from fieldrl.core.kinds import component
from fieldrl.vehicle.motion import advance, advance_many, follow
from fieldrl.vehicle.sensor import Sensor

ACTION_NAMES = (
    "full speed ahead",
    "half speed ahead",
    "full speed, turn clockwise",
    "full speed, turn counter-clockwise",
    "half speed, turn clockwise",
    "half speed, turn counter-clockwise",
    "drift",
)

_PLANNED = 4  # substeps of a step that is only planned
_SUBSTEP = 2e-7  # time of a Runge-Kutta step [s]


class Flow(Protocol):
    """What the vehicle needs of a flow; see fieldrl.core.flow_adapter for how it calls one."""

    @property
    def velocity(self) -> Any:
        """Of (theta, x, y, t): (u, v) [length/time]; of a flow that is compiled already, see FLOW."""
        ...


@component
class Unicycle:
    """The kinematic model of Eq. (10) with the actions of Eq. (12).

    Within a step the heading turns at the rate turn / time_step until it reaches a limit, where it stays.
    Position is integrated by classical Runge-Kutta. The vehicle slides along the domain's wall. A move
    into an obstacle stops at its edge, where the vehicle rests for as long as its velocity points inwards.

    Args:
        start: where every episode begins, (x, y) [length].
        heading: heading at the start [rad].
        max_speed: v_max > 0 [length/time].
        turn: phi of Eq. (12), the angle turned within one step, in (0, pi] [rad].
        heading_limits: least and greatest heading, or None: no limits, headings wrap at pi [rad].
        time_step: how long an action lasts, > 0 [time].
        substeps: Runge-Kutta steps in a time step, >= 1.
        sensor: what the vehicle sees.
    """

    start: Sequence[float] = (20.0, 20.0)
    heading: float = 0.0
    max_speed: float = 10.0
    turn: float = math.pi / 8
    heading_limits: Sequence[float] | None = (-math.pi / 4, math.pi / 4)
    time_step: float = 1.0
    substeps: int = 20
    sensor: Sensor = field(default_factory=Sensor)

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", checks.vector("start", self.start, 2, "length"))
        object.__setattr__(self, "max_speed", checks.positive("max_speed", self.max_speed, "length/time"))
        object.__setattr__(self, "time_step", checks.positive("time_step", self.time_step, "time"))
        object.__setattr__(self, "substeps", checks.integer("substeps", self.substeps, 1))
        if not 0 < checks.number("turn", self.turn, "rad") <= math.pi:
            raise checks.InvalidValue("turn", self.turn, "must lie in (0, pi]", "rad")
        if self.heading_limits is not None:
            limits = checks.interval("heading_limits", self.heading_limits, "rad")
            object.__setattr__(self, "heading_limits", limits)
        low, high = self.heading_bounds
        if not low <= checks.number("heading", self.heading, "rad") <= high:
            rule = f"must lie in [{low:g}, {high:g}], the heading_limits"
            raise checks.InvalidValue("heading", self.heading, rule, "rad")
        object.__setattr__(self, "heading", float(self.heading))

    @property
    def heading_bounds(self) -> tuple[float, float]:
        """Least and greatest heading that a state can have: the limits, or (-pi, pi) [rad]."""
        return (
            (-math.pi, math.pi)
            if self.heading_limits is None
            else (self.heading_limits[0], self.heading_limits[1])
        )

    @cached_property
    def actions(self) -> NDArray[np.float64]:
        """Rows (speed, angle turned in the step) in the order of Eq. (12), (7, 2) [length/time, rad]."""
        full, half, turn = self.max_speed, self.max_speed / 2, self.turn
        rows = [
            (full, 0.0),
            (half, 0.0),
            (full, -turn),
            (full, turn),
            (half, -turn),
            (half, turn),
            (0.0, 0.0),
        ]
        return np.array(rows)

    @property
    def action_names(self) -> tuple[str, ...]:
        """A few words for each action, (7,)."""
        return ACTION_NAMES

    def cost(self, extent: Extent) -> Cost:
        """Time to move."""
        return Cost(seconds=extent.samples * self.substeps * _SUBSTEP, by=("substeps",))

    def initial(self) -> NDArray[np.float64]:
        """The state at the start of an episode, (3,) [length, length, rad]."""
        return np.array([*self.start, self.heading])

    def check_start(self, domain: Domain) -> None:
        """Raises InvalidValue("start", ...) where the start is not in the water of ``domain``."""
        if not domain.contains(np.array(self.start)):
            corners = f"{list(domain.lower)} to {list(domain.upper)}"
            rule = f"must lie in the domain, {corners}, and outside its {len(domain.obstacles)} obstacles"
            raise checks.InvalidValue("start", self.start, rule, "length", "move the start or the obstacle")

    def step(
        self,
        state: NDArray[np.float64],
        action: int,
        time: float,
        flow: Flow,
        theta: NDArray[np.float64],
        domain: Domain,
    ) -> NDArray[np.float64]:
        """The state after one time step, Eq. (10).

        Args:
            state: a state in the water, (3,) [length, length, rad].
            action: index into ``actions``, 0 to 6; IndexError beyond.
            time: when the step begins [time].
            flow: the water's flow, of any class.
            theta: the flow's parameters, (p,).
            domain: walls and obstacles.

        Returns:
            A new state in the water, (3,) [length, length, rad].
        """
        speed, rate, low, high = self._controls[action]
        own, theta = adapted(flow), np.ascontiguousarray(theta, dtype=np.float64)
        span = (float(time), self.time_step, self.substeps)
        after = advance(
            state, speed, rate, low, high, *span, own.kernel, theta, own.constants, *_obstructions(domain)
        )
        if self.heading_limits is None and abs(after[2]) > math.pi:
            after[2] = math.remainder(after[2], 2 * math.pi)
        return after

    def step_many(
        self,
        states: NDArray[np.float64],
        actions: NDArray[np.int64],
        times: NDArray[np.float64],
        flow: Flow,
        thetas: NDArray[np.float64],
        domain: Domain,
    ) -> NDArray[np.float64]:
        """``step`` of B vehicles, each in a water of its own: the same numbers.

        Args:
            states: states in the water, (B, 3) [length, length, rad].
            actions: indices into ``actions``, (B,).
            times: when each step begins, (B,) [time].
            flow: the flow, of any class.
            thetas: its parameters in each water, (B, p).
            domain: walls and obstacles.

        Returns:
            New states, (B, 3) [length, length, rad].
        """
        own, after = adapted(flow), np.array(states, dtype=np.float64)
        span, water = (self.time_step, self.substeps), (own.kernel, thetas, own.constants)
        controls = np.array(self._controls)[actions]
        advance_many(after, controls, times, *span, *water, *_obstructions(domain))
        if self.heading_limits is None:
            for i in np.flatnonzero(np.abs(after[:, 2]) > math.pi):
                after[i, 2] = math.remainder(after[i, 2], 2 * math.pi)
        return after

    def paths(
        self,
        state: NDArray[np.float64],
        plans: NDArray[np.int64],
        time: float,
        flow: Flow,
        thetas: NDArray[np.float64],
        domain: Domain,
    ) -> NDArray[np.float64]:
        """The states along K plans in M waters, as by repeated ``step`` but with at most 4 substeps.

        Args:
            state: a state in the water, (3,) [length, length, rad].
            plans: actions, (K, H).
            time: when the first step begins [time].
            flow: the water's flow, of any class.
            thetas: the flow's parameters, (M, p).
            domain: walls and obstacles.

        Returns:
            (M, K, H, 3) [length, length, rad]; headings are not wrapped.
        """
        own, thetas = adapted(flow), np.ascontiguousarray(thetas, dtype=np.float64)
        span = (float(time), self.time_step, min(self.substeps, _PLANNED))
        water = (own.kernel, thetas, own.constants, *_obstructions(domain))
        return follow(np.array(state, dtype=float), plans, np.array(self._controls), *span, *water)

    @cached_property
    def _controls(self) -> tuple[tuple[float, float, float, float], ...]:
        """Speed, heading rate and heading limits of every action."""
        low, high = (-math.inf, math.inf) if self.heading_limits is None else self.heading_bounds
        return tuple((float(speed), float(turn) / self.time_step, low, high) for speed, turn in self.actions)


@lru_cache(maxsize=64)
def _obstructions(domain: Domain) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Walls (4,), rectangles (k, 4) and circles (k, 3) of a domain, as ``advance`` wants them [length]."""
    rectangles = [_sides(shape) for shape in domain.obstacles if isinstance(shape, Rectangle)]
    circles = [(*shape.centre, shape.radius) for shape in domain.obstacles if isinstance(shape, Circle)]
    return (
        np.array(_sides(domain)),
        np.array(rectangles, dtype=float).reshape(-1, 4),
        np.array(circles, dtype=float).reshape(-1, 3),
    )


def _sides(box: Rectangle | Domain) -> tuple[float, float, float, float]:
    """x_low, x_high, y_low, y_high [length]."""
    return box.lower[0], box.upper[0], box.lower[1], box.upper[1]
