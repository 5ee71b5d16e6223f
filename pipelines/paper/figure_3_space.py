"""Which settings of the first experiment the paper leaves unsaid, and between which values they are searched.

What it says stays: b = (5, 5), 20 samples with noise 1 in each of 400 episodes, a feature of height 100 and
scale 40, headings within 45 degrees, eight tilings of 8 x 8 tiles, replacing traces, Eq. (19).
"""

from __future__ import annotations

from typing import Any

from fieldrl.sweeps.space import Dimension, Point, Space, of_choices

SPACE = Space(
    (
        Dimension("start x", 5.0, 150.0),
        Dimension("start y", 5.0, 150.0),
        Dimension("centre", 20.0, 150.0),
        Dimension("side", 160.0, 400.0),
        Dimension("v_max", 2.0, 40.0, log=True),
        Dimension("phi", 0.1, 1.5, log=True),
        Dimension("time step", 0.1, 2.0, log=True),
        Dimension("bound", 6.0, 50.0, log=True),
        Dimension("tikhonov", 1e-6, 0.1, log=True),
        of_choices("starts", ("1", "4")),
        of_choices("initial value", ("0", "50", "200")),
        of_choices("gamma", ("0.8", "0.95", "1")),
    ),
    (),
)
"""Centre: c = (centre, centre); side: of the domain; bound: half-width of the bounds of b; starts: 1, a local
optimiser, or 4, global fits; initial value: of every action, where Algorithm 1 says w in R^d."""

SHIPPED = {
    "start x": 20.0, "start y": 20.0, "centre": 50.0, "side": 200.0, "v_max": 10.0, "phi": 0.392699,
    "time step": 1.0, "bound": 15.0, "tikhonov": 1e-3, "starts": "4", "initial value": "0", "gamma": "1",
}  # fmt: skip
"""What ``experiment=advection`` has."""

NAMED = {
    "one start, values from 200": SHIPPED | {"starts": "1", "initial value": "200"},
    "one start": SHIPPED | {"starts": "1"},
}
"""Settings that are looked at whatever the search finds; global fits as shipped have their claims already."""


def named(settings: dict[str, Any]) -> Point:
    """Settings by name as a point of the space."""
    point = SPACE.point([str(settings[key]) for key in SPACE.keys])
    if point is None:
        raise ValueError(f"not of the space: {settings}")
    return point


def described(point: Point) -> dict[str, str]:
    """A point by name, as text."""
    return {
        key: dimension.text(value)
        for key, dimension, value in zip(SPACE.keys, SPACE.dimensions, point, strict=True)
    }


def overrides(point: Point) -> tuple[str, ...]:
    """A point as overrides of ``experiment=advection``."""
    at = described(point)
    return (
        f"vehicle.start=[{at['start x']},{at['start y']}]",
        f"pde.initial.centre=[{at['centre']},{at['centre']}]",
        f"pde.domain.upper=[{at['side']},{at['side']}]",
        f"vehicle.max_speed={at['v_max']}",
        f"vehicle.turn={at['phi']}",
        f"vehicle.time_step={at['time step']}",
        f"pde.lower=[-{at['bound']},-{at['bound']}]",
        f"pde.upper=[{at['bound']},{at['bound']}]",
        f"estimator.tikhonov={at['tikhonov']}",
        f"estimator.starts={at['starts']}",
        f"+agent.initial_value={at['initial value']}",
        f"agent.discount={at['gamma']}",
    )
