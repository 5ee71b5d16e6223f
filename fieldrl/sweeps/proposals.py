"""Where to try next: Gaussian-process Bayesian optimisation by scikit-optimize, behind this one file.

A proposal is a pure function of the space, the trials so far and the seed: the surrogate is fitted anew each
time and never kept. So the list of trials is the whole state of a search, and a search that is continued
proposes what an uninterrupted one would have proposed.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skopt import Optimizer
from skopt.sampler import Lhs
from skopt.space import Categorical, Integer, Real
from threadpoolctl import threadpool_limits

from fieldrl.core.streams import stream
from fieldrl.sweeps.space import Dimension, Point, Space

Trial = tuple[Point, float | None]
"""A point and the loss found there; None where the job failed."""

_DRAWS = 2000  # attempts at a point that has not been tried
_SAMPLES, _VALUES = 200, 40  # of the other keys, and of the key itself, in a dependence


def propose(space: Space, trials: Sequence[Trial], count: int, initial: int, seed: int) -> list[Point]:
    """Points to try next, none of them tried before.

    The first ``initial`` points are a Latin hypercube; then expected improvement, several at a time by the
    constant liar (each is believed to be as good as the best so far).

    Args:
        space: what is searched.
        trials: all so far, in their order.
        count: how many points, >= 1.
        initial: size of the initial design, >= 1.
        seed: of every random choice.

    Returns:
        At most ``count`` points, and at most what is left of the initial design; none where everything has
        been tried.
    """
    told = len(trials)
    with _one_quiet_thread():
        if told < initial:
            found = _design(space, initial, seed)[told : told + count]
        else:
            optimizer = _fitted(space, trials, seed)
            found = optimizer.ask(n_points=count, strategy="cl_min") or []
    return _new(space, found, [point for point, _ in trials], seed)


def losses(trials: Sequence[Trial]) -> NDArray[np.float64]:
    """The loss of each trial, (n,); a failed one counts as much as the worst of the others."""
    bad = max((loss for _, loss in trials if loss is not None), default=0.0)
    return np.array([bad if loss is None else loss for _, loss in trials])


def dependence(space: Space, trials: Sequence[Trial], seed: int) -> list[tuple[list[Any], NDArray]]:
    """For each dimension: values along it, and the surrogate's mean loss there over the other dimensions.

    Args:
        space: what was searched.
        trials: at least two of them.
        seed: of the sample of the other dimensions.
    """
    with _one_quiet_thread():
        optimizer = _fitted(space, trials, seed)
        model, scale = optimizer.models[-1], optimizer.space
        others = [list(point) for point in scale.rvs(_SAMPLES, random_state=seed)]
        found = []
        for i, dimension in enumerate(space.dimensions):
            values = _along(dimension)
            points = [[*point[:i], value, *point[i + 1 :]] for value in values for point in others]
            mean = model.predict(scale.transform(points)).reshape(len(values), len(others)).mean(axis=1)
            found.append((values, mean))
    return found


def _fitted(space: Space, trials: Sequence[Trial], seed: int) -> Optimizer:
    """An optimizer that has been told everything."""
    optimizer = Optimizer(
        [_skopt(dimension) for dimension in space.dimensions],
        base_estimator="GP",
        acq_func="EI",
        n_initial_points=1,
        random_state=_state(seed, len(trials)),
    )
    optimizer.tell([list(point) for point, _ in trials], losses(trials).tolist())
    return optimizer


def _design(space: Space, initial: int, seed: int) -> list[list[Any]]:
    dimensions = [_skopt(dimension) for dimension in space.dimensions]
    if initial == 1:  # a hypercube of one point has no distances to spread
        return [[dimension.rvs(random_state=_state(seed, 0))[0] for dimension in dimensions]]
    points: Any = Lhs(criterion="maximin", iterations=100).generate(
        dimensions, initial, random_state=_state(seed, 0)
    )
    return points


def _new(space: Space, found: Sequence[Sequence[Any]], tried: Sequence[Point], seed: int) -> list[Point]:
    """The points as they will be typed; one that was tried before makes way for a random one."""
    seen, new = set(tried), []
    random = stream(seed, "sweeper", len(tried))
    for point in found:
        typed = _typed(space, point)
        for _ in range(_DRAWS):
            if typed not in seen:
                break
            typed = tuple(_anywhere(dimension, random) for dimension in space.dimensions)
        else:
            continue
        seen.add(typed)
        new.append(typed)
    return new


def _typed(space: Space, point: Sequence[Any]) -> Point:
    pairs = zip(space.dimensions, point, strict=True)
    return tuple(dimension.rounded(value) for dimension, value in pairs)


def _anywhere(dimension: Dimension, random: np.random.Generator) -> Any:
    if dimension.choices:
        return int(random.integers(len(dimension.choices)))
    if dimension.whole:
        return int(random.integers(int(dimension.low), int(dimension.high) + 1))
    return dimension.rounded(_between(dimension, random.random()))


def _between(dimension: Dimension, share: float) -> float:
    low, high = dimension.low, dimension.high
    return float(low * (high / low) ** share if dimension.log else low + share * (high - low))


def _along(dimension: Dimension) -> list[Any]:
    """Values along a dimension, in order."""
    if dimension.choices:
        return list(range(len(dimension.choices)))
    values = [_between(dimension, share) for share in np.linspace(0, 1, _VALUES)]
    if dimension.whole:
        return sorted({round(value) for value in values})
    return [min(max(value, dimension.low), dimension.high) for value in values]


def _skopt(dimension: Dimension) -> Any:
    prior = "log-uniform" if dimension.log else "uniform"
    if dimension.ordered and len(dimension.choices) > 1:
        return Integer(0, len(dimension.choices) - 1)
    if dimension.choices:
        return Categorical(list(range(len(dimension.choices))))
    if dimension.whole:
        return Integer(int(dimension.low), int(dimension.high), prior=prior)
    return Real(float(dimension.low), float(dimension.high), prior=prior)


def _state(seed: int, told: int) -> int:
    """A seed for scikit-optimize."""
    return int(stream(seed, "scikit-optimize", told).integers(2**31))


@contextmanager
def _one_quiet_thread() -> Iterator[None]:
    """One thread, so that no bit depends on their number, and no warnings, which nobody could act on."""
    with threadpool_limits(limits=1), warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield
