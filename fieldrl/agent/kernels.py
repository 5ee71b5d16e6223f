"""Compiled inner loops of the learning agent: tile coding, epsilon-greedy choice, Algorithm 1.

| symbol | meaning | shape | unit |
|---|---|---|---|
| coder | for each tiled variable: its index, origin, 1 / tile width, tiles, offsets | (d, 4 + T) | mixed |
| w | weights; q(s, a) is the sum of row a over the active features of s | (actions, features) | reward |
| z | eligibility traces | (actions, features) | - |
| eligible | flat indices of z != 0, the first ``count[0]`` hold | (actions * features,) | - |

They share one file because numba's cache follows one file only.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

CUT_OFF = 1e-10
REPLACING, ACCUMULATING, DUTCH = 0, 1, 2


@njit(cache=True)
def active_features(observation, coder):
    """Index of the active feature in each tiling, (T,), for an observation (k,)."""
    tilings = coder.shape[1] - 4
    features = np.empty(tilings, np.int64)
    for tiling in range(tilings):
        features[tiling] = tiling
    for row in coder:
        tiles = int(row[3])
        position = (observation[int(row[0])] - row[1]) * row[2]
        for tiling in range(tilings):
            tile = _tile(position + row[4 + tiling], tiles)
            features[tiling] = features[tiling] * tiles + tile
    return features


@njit(cache=True)
def _tile(position, tiles):
    """The tile that holds a position counted in tiles; the one at the edge beyond, the first for nan."""
    if position >= tiles:
        return tiles - 1
    return math.floor(position) if position > 0.0 else 0


@njit(cache=True)
def choose(weights, coder, observation, exploration, first, second):
    """An epsilon-greedy action from two uniform numbers in [0, 1); equal values are equally likely."""
    actions = weights.shape[0]
    if first < exploration:
        return int(second * actions)
    features = active_features(observation, coder)
    values = np.empty(actions)
    for action in range(actions):
        values[action] = _value(weights[action], features)
    best = values.max()
    rank = int(second * np.sum(values == best))
    for action in range(actions):
        if values[action] == best:
            if rank == 0:
                return action
            rank -= 1
    return int(second * actions)


@njit(cache=True)
def learn(
    weights,
    traces,
    eligible,
    count,
    previous,
    step_size,
    coder,
    kind,
    discount,
    decay,
    observation,
    action,
    reward,
    next_observation,
    next_action,
    terminated,
):
    """One pass of Algorithm 1, lines 7 to 18, in place. Returns delta, Eq. (24).

    Args:
        weights: w, (actions, features).
        traces: z, (actions, features).
        eligible: indices of the non-zero traces, (actions * features,).
        count: how many of them there are, (1,).
        previous: Dutch traces only: the value that the last update expected of this state, (1,).
        step_size: alpha of each tiling, (1,).
        coder: the tile coding, (d, 4 + T).
        kind: REPLACING, ACCUMULATING or DUTCH.
        discount: gamma.
        decay: gamma lambda.
        observation: s, (4,).
        action: a.
        reward: r.
        next_observation: s', (4,).
        next_action: a'; not looked at where ``terminated``.
        terminated: is s' terminal?
    """
    alpha = step_size[0]
    features = active_features(observation, coder)
    value = _value(weights[action], features)
    following = 0.0
    if not terminated:
        following = _value(weights[next_action], active_features(next_observation, coder))
    delta = reward + discount * following - value
    _mark(traces[action], action * weights.shape[1], features, eligible, count, kind, alpha)
    surprise = value - previous[0] if kind == DUTCH else 0.0
    _update(weights, traces, eligible, count, alpha * (delta + surprise), decay)
    for feature in features:
        weights[action, feature] -= alpha * surprise
    previous[0] = following
    return delta


@njit(cache=True)
def _value(row, features):
    """q(s, a): the sum of a row's weights over the active features."""
    value = 0.0
    for feature in features:
        value += row[feature]
    return value


@njit(cache=True)
def _mark(row, offset, features, eligible, count, kind, alpha):
    """Raise the traces of the active features (line 10), remembering those that were zero."""
    raised = 1.0 - alpha * _value(row, features) if kind == DUTCH else 1.0
    for feature in features:
        if row[feature] == 0.0:
            eligible[count[0]] = offset + feature
            count[0] += 1
        row[feature] = 1.0 if kind == REPLACING else row[feature] + raised


@njit(cache=True)
def _update(weights, traces, eligible, count, step, decay):
    """Lines 17 and 18 for the eligible features: w += step z, z *= decay; forget those below CUT_OFF."""
    w, z = weights.reshape(-1), traces.reshape(-1)
    kept = 0
    for i in range(count[0]):
        feature = eligible[i]
        w[feature] += step * z[feature]
        z[feature] *= decay
        if abs(z[feature]) < CUT_OFF:
            z[feature] = 0.0
        else:
            eligible[kept] = feature
            kept += 1
    count[0] = kept


@njit(cache=True)
def forget(traces, eligible, count):
    """z <- 0 (line 4), touching the eligible features only."""
    z = traces.reshape(-1)
    for i in range(count[0]):
        z[eligible[i]] = 0.0
    count[0] = 0
