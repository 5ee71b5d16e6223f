"""``hydra/sweeper=grid``: every combination of the values given."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import partial

from fieldrl.sweeps.execution import Execution
from fieldrl.sweeps.pictures import draw_grid


def run(execution: Execution, jobs: Sequence[Sequence[str]]) -> None:
    """Run every combination.

    Args:
        execution: of the sweep.
        jobs: the overrides of each job.

    Raises:
        FieldrlError: every job is refused, or one failed.
    """
    try:
        execution.batch(jobs)
        execution.finish(partial(draw_grid, varied=execution.varied, objective=execution.objective))
    finally:
        execution.close()


def combinations(values: Mapping[str, Sequence[str]]) -> list[tuple[str, ...]]:
    """The overrides of each job from the values of each key, the last key varying fastest."""
    return list(itertools.product(*([f"{key}={value}" for value in each] for key, each in values.items())))
