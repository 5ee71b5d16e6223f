"""Compiled motion within one step: Eq. (10) integrated by classical Runge-Kutta, walls and obstacles.

| symbol | meaning | shape | unit |
|---|---|---|---|
| state | x, y, heading phi (counter-clockwise from the x axis) | (3,) | length, length, rad |
| speed, rate | u_v and u_omega of Eq. (10), constant within the step | scalar | length/time, rad/time |
| walls | least and greatest x, least and greatest y of the domain | (4,) | length |
| rectangles | x_low, x_high, y_low, y_high of each | (k, 4) | length |
| circles | x, y, radius of each | (k, 3) | length |
| kernel, constants | address of the flow's FLOW function, and what it needs | int, (k,) | - |

The heading is known in closed form; a step in which it reaches its limit is cut there, so that each
piece is smooth. In open water and along a wall of uniform flow the error falls with the fourth power of the
substep; the moment at which the vehicle leaves an obstacle's edge is found to one substep only. The compiled
helpers share this file because numba's cache follows one file only.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from fieldrl.core.compiled import call_flow

_NEVER = 2.0
_SLIVER = 1e-12
_SKIN = 1e-14


@njit(cache=True)
def advance(
    state,
    speed,
    rate,
    low,
    high,
    time,
    duration,
    substeps,
    kernel,
    theta,
    constants,
    walls,
    rectangles,
    circles,
):
    """The state (3,) at the end of a step of ``duration`` [time] that begins at ``time``.

    Args:
        state: a state in the water, (3,).
        speed: forward speed u_v [length/time].
        rate: heading rate u_omega while the heading is within its limits [rad/time].
        low: least heading, -inf where there is none [rad].
        high: greatest heading, inf where there is none [rad].
        time: when the step begins [time].
        duration: how long it lasts [time].
        substeps: Runge-Kutta steps in it.
        kernel: address of the flow's compiled function.
        theta: flow parameters, (p,).
        constants: the flow's constants, (k,).
        walls: (4,) [length].
        rectangles: (k, 4) [length].
        circles: (k, 3) [length].
    """
    pose = state.copy()
    velocity = np.empty(2)
    turning = _turning_time(state[2], rate, low, high, duration)
    water = (kernel, theta, constants, walls, rectangles, circles)
    for rate_now, start, length in ((rate, 0.0, turning), (0.0, turning, duration - turning)):
        if length > 0.0:
            count = max(math.ceil(substeps * length / duration - 1e-9), 1)
            _piece(pose, speed, rate_now, time + start, length, count, water, velocity)
        if start < turning < duration:
            pose[2] = high if rate > 0.0 else low
    pose[2] = min(max(pose[2], low), high)
    return pose


@njit(cache=True)
def advance_many(
    states, controls, times, duration, substeps, kernel, thetas, constants, walls, rectangles, circles
):
    """``advance`` for vehicles that know nothing of each other: states (B, 3), in place.

    A row of ``controls`` (B, 4) is speed, rate, low, high; times (B,) and thetas (B, p) are each one's own.
    """
    for b in range(states.shape[0]):
        speed, rate, low, high = controls[b]
        states[b] = advance(
            states[b],
            speed,
            rate,
            low,
            high,
            times[b],
            duration,
            substeps,
            kernel,
            thetas[b],
            constants,
            walls,
            rectangles,
            circles,
        )


@njit(cache=True)
def follow(
    state,
    plans,
    controls,
    time,
    duration,
    substeps,
    kernel,
    thetas,
    constants,
    walls,
    rectangles,
    circles,
):
    """The states (M, K, H, 3) along plans (K, H) of ``controls`` (actions, 4), for flow parameters (M, p).

    A row of ``controls`` is speed, rate, low, high of ``advance``; the rest is as there.
    """
    count, horizon = plans.shape
    states = np.empty((thetas.shape[0], count, horizon, 3))
    for m in range(thetas.shape[0]):
        for k in range(count):
            now = state
            for i in range(horizon):
                speed, rate, low, high = controls[plans[k, i]]
                now = advance(
                    now,
                    speed,
                    rate,
                    low,
                    high,
                    time + i * duration,
                    duration,
                    substeps,
                    kernel,
                    thetas[m],
                    constants,
                    walls,
                    rectangles,
                    circles,
                )
                states[m, k, i] = now
    return states


@njit(cache=True)
def _turning_time(heading, rate, low, high, duration):
    """How long the heading turns before it reaches its limit, at most ``duration`` [time]."""
    if rate == 0.0:
        return duration
    limit = high if rate > 0.0 else low
    turning = min(max((limit - heading) / rate, 0.0), duration)
    if turning < _SLIVER * duration:
        return 0.0
    return duration if duration - turning < _SLIVER * duration else turning


@njit(cache=True)
def _piece(pose, speed, rate, time, length, count, water, velocity):
    """Move ``pose`` in place over a smooth piece of the step, in ``count`` substeps."""
    h = length / count
    first = pose[2]
    for i in range(count):
        heading = first + rate * h * i
        x, y = _runge_kutta(pose[0], pose[1], heading, speed, rate, time + i * h, h, water, velocity)
        x, y = _inside_walls(x, y, water[3])
        pose[0], pose[1] = _stopped(pose[0], pose[1], x, y, water[4], water[5])
    pose[2] = first + rate * length


@njit(cache=True)
def _runge_kutta(x, y, heading, speed, rate, t, h, water, velocity):
    """One classical fourth-order step of Eq. (10) for the position, walls not yet applied."""
    half = 0.5 * h
    ax, ay = _velocity(x, y, heading, speed, t, water, velocity)
    bx, by = _velocity(x + half * ax, y + half * ay, heading + half * rate, speed, t + half, water, velocity)
    cx, cy = _velocity(x + half * bx, y + half * by, heading + half * rate, speed, t + half, water, velocity)
    dx, dy = _velocity(x + h * cx, y + h * cy, heading + h * rate, speed, t + h, water, velocity)
    return x + h / 6 * (ax + 2 * (bx + cx) + dx), y + h / 6 * (ay + 2 * (by + cy) + dy)


@njit(cache=True)
def _velocity(x, y, heading, speed, t, water, velocity) -> tuple[float, float]:
    """Right-hand side of Eq. (10) for x and y; the flow is asked within the walls only."""
    kernel, theta, constants, walls, _, _ = water
    x, y = _inside_walls(x, y, walls)
    call_flow(kernel, theta.ctypes, constants.ctypes, x, y, t, velocity.ctypes)  # pyright: ignore[reportCallIssue]
    return speed * math.cos(heading) + velocity[0], speed * math.sin(heading) + velocity[1]


@njit(cache=True)
def _inside_walls(x, y, walls):
    """The nearest point of the domain's rectangle: a move across the wall slides along it."""
    return min(max(x, walls[0]), walls[1]), min(max(y, walls[2]), walls[3])


@njit(cache=True)
def _stopped(x0, y0, x1, y1, rectangles, circles):
    """Where a straight move from water (x0, y0) to (x1, y1) ends: there, or at the first obstacle's edge."""
    first = _NEVER
    for i in range(rectangles.shape[0]):
        first = min(first, _entry_rectangle(x0, y0, x1, y1, rectangles[i]))
    for i in range(circles.shape[0]):
        first = min(first, _entry_circle(x0, y0, x1, y1, circles[i]))
    if first <= 1.0:
        x1, y1 = x0 + first * (x1 - x0), y0 + first * (y1 - y0)
    if _in_obstacle(x1, y1, rectangles, circles):
        return _last_water(x0, y0, x1, y1, rectangles, circles)
    return x1, y1


@njit(cache=True)
def _last_water(x0, y0, x1, y1, rectangles, circles):
    """By bisection, the edge between water (x0, y0) and a point that rounding has put into an obstacle."""
    for _ in range(60):
        x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        if _in_obstacle(x, y, rectangles, circles):
            x1, y1 = x, y
        else:
            x0, y0 = x, y
    return x0, y0


@njit(cache=True)
def _entry_rectangle(x0, y0, x1, y1, box):
    """The fraction of the move at which it enters the open rectangle, or 2 if it never does."""
    enter, leave = 0.0, 1.0
    for start, end, low, high in ((x0, x1, box[0], box[1]), (y0, y1, box[2], box[3])):
        if start == end:
            if not low < start < high:
                return _NEVER
        else:
            a, b = (low - start) / (end - start), (high - start) / (end - start)
            enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter if enter < leave else _NEVER


@njit(cache=True)
def _entry_circle(x0, y0, x1, y1, circle):
    """The fraction of the move at which it enters the open disc, or 2 if it never does."""
    dx, dy, mx, my = x1 - x0, y1 - y0, x0 - circle[0], y0 - circle[1]
    along = dx * mx + dy * my
    outside = max(math.hypot(mx, my) - circle[2], 0.0) * (math.hypot(mx, my) + circle[2])
    discriminant = along * along - (dx * dx + dy * dy) * outside
    if along >= 0.0 or discriminant <= 0.0:
        return _NEVER
    fraction = outside / (math.sqrt(discriminant) - along)
    return fraction if fraction <= 1.0 else _NEVER


@njit(cache=True)
def _in_obstacle(x, y, rectangles, circles):
    """Does the point lie in the open interior of an obstacle (a circle's edge included, for rounding)?"""
    for i in range(rectangles.shape[0]):
        box = rectangles[i]
        if box[0] < x < box[1] and box[2] < y < box[3]:
            return True
    for i in range(circles.shape[0]):
        if math.hypot(x - circles[i, 0], y - circles[i, 1]) < circles[i, 2] * (1 + _SKIN):
            return True
    return False
